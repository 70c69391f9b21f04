#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace relume {

// The whole file. Throws kNotFound if it can't be opened, kDataLoss if reading fails.
std::string ReadFile(const std::filesystem::path& path);

// Writes to a temporary name in the same folder, syncs and renames: readers see the old file or the
// whole new one. Links are followed; a device or pipe is written to directly. Throws
// kResourceExhausted (disk full) or kFailedPrecondition, naming path and reason; nothing is left
// behind then.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes);

// A fresh, empty folder that is removed with all that is in it when the object dies.
class TemporaryFolder {
  public:
    // In `parent`, or in the system's temporary folder if that is empty.
    explicit TemporaryFolder(const std::filesystem::path& parent = {});
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

}  // namespace relume
