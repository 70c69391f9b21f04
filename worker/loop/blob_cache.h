#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace relume::worker {

// Writes the bytes of one blob from `offset` on into `sink`, in order; throws Error if it can't.
using BlobFetch = std::function<void(const std::string& sha256, std::uint64_t offset,
                                     const std::function<void(const std::string& data)>& sink)>;

// Files by digest in a folder, of at most `max_bytes` in all: the least recently used ones go
// first. Thread-safe, and safe for several processes on one folder: a blob is written under the
// name DIGEST.part, which its writer holds locked, checked, and renamed to DIGEST. Whoever else
// wants it waits for the lock. A broken transfer leaves its part behind and goes on there.
class BlobCache {
  public:
    BlobCache(std::filesystem::path folder, std::uint64_t max_bytes);

    // Sees to it that the blob is there. Throws kResourceExhausted if the disk is full, kDataLoss
    // if what arrives is not the blob kFetchAttempts times, and whatever `fetch` throws.
    void Ensure(const std::string& sha256, std::uint64_t size, const BlobFetch& fetch);

    // The blob's bytes, checked again: a file that decayed on disk is fetched anew.
    std::string Read(const std::string& sha256, std::uint64_t size, const BlobFetch& fetch);

    bool Has(const std::string& sha256) const;

    static constexpr int kFetchAttempts = 3;

  private:
    std::filesystem::path PathOf(const std::string& sha256) const;
    void Download(const std::string& sha256, std::uint64_t size, const BlobFetch& fetch) const;
    // Removes the least recently used blobs until `incoming` more bytes fit. `keep` stays.
    void MakeRoom(std::uint64_t incoming, const std::string& keep) const;

    std::filesystem::path folder_;
    std::uint64_t max_bytes_;
};

}  // namespace relume::worker
