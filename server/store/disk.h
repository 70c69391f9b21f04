#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

namespace relume::store {

// The few things that are done with files that must not be lost: a seam at which tests make them
// fail. Failures are Errors: kResourceExhausted for a full disk, else kFailedPrecondition, one line
// with path, reason and remedy. Thread-safe.
class Disk {
  public:
    virtual ~Disk() = default;

    // A new file, written from its beginning. Not synced and not closed well, it may be lost.
    class File {
      public:
        virtual ~File() = default;
        virtual void Write(std::string_view bytes) = 0;
        virtual void Sync() = 0;
    };
    virtual std::unique_ptr<File> Create(const std::filesystem::path& path) = 0;
    // Replaces what is there, and survives a loss of power when it returns.
    virtual void Rename(const std::filesystem::path& from, const std::filesystem::path& to) = 0;
    // Nothing, if it is not there.
    virtual void Remove(const std::filesystem::path& path) = 0;
};

// The operating system's.
std::shared_ptr<Disk> RealDisk();

// Writes to a temporary name beside it, syncs and renames: readers see the old file or the whole
// new one. Nothing is left behind if it fails.
void WriteWholeFile(Disk* disk, const std::filesystem::path& path, std::string_view bytes);

}  // namespace relume::store
