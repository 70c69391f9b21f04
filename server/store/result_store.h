#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "server/store/disk.h"

namespace relume::store {

// Finished images, one file a job: <folder>/<id>.exr. Thread-safe: files are written whole and
// renamed.
class ResultStore {
  public:
    explicit ResultStore(const std::filesystem::path& folder,
                         std::shared_ptr<Disk> disk = RealDisk());

    // `id`: 1 to 64 lower-case letters, digits and '-'; anything else throws kInvalidArgument.
    // A full disk throws kResourceExhausted and leaves nothing behind.
    void Put(const std::string& id, std::string_view bytes);
    // At most `limit` bytes from `offset` on; empty at the end. Throws kNotFound.
    std::string Read(const std::string& id, std::uint64_t offset, std::size_t limit) const;
    void Remove(const std::string& id);

  private:
    std::filesystem::path PathOf(const std::string& id) const;

    std::filesystem::path folder_;
    std::shared_ptr<Disk> disk_;
};

// At most `limit` bytes of a file from `offset` on. Throws kNotFound if it can't be opened,
// kDataLoss if reading fails.
std::string ReadPiece(const std::filesystem::path& path, std::uint64_t offset, std::size_t limit);

}  // namespace relume::store
