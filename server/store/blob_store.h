#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "core/base/sha256.h"

namespace relume::store {

// Files by their SHA-256: <folder>/ab/abcd....; an unfinished upload is abcd....part. Only 64
// lower-case hexadecimal digits ever become a file name. Thread-safe.
class BlobStore {
  public:
    // `quota`: bytes of all blobs and unfinished uploads together. What earlier runs left is kept;
    // unfinished uploads older than a week are not.
    BlobStore(const std::filesystem::path& folder, std::uint64_t quota);

    // Every `sha256` that is not of that form throws kInvalidArgument.
    bool Has(const std::string& sha256) const;
    // Of a whole blob; throws kNotFound.
    std::uint64_t SizeOf(const std::string& sha256) const;
    // Bytes that an unfinished upload has got so far; 0 if there is none.
    std::uint64_t PartSize(const std::string& sha256) const;
    // At most `limit` bytes of a whole blob; empty at the end. Throws kNotFound.
    std::string Read(const std::string& sha256, std::uint64_t offset, std::size_t limit) const;
    std::uint64_t used() const;
    std::uint64_t quota() const { return quota_; }

    // One upload from an offset on; used by one thread at a time. What is there when it dies
    // unfinished is kept and goes on from there.
    class Upload {
      public:
        ~Upload();
        Upload(const Upload&) = delete;
        Upload& operator=(const Upload&) = delete;

        // The next bytes. More than the size said throws kInvalidArgument, a full disk
        // kResourceExhausted; what was there of the blob is removed then.
        void Append(std::string_view bytes);
        std::uint64_t offset() const { return offset_; }
        bool complete() const { return offset_ == size_; }
        // Call when complete: checks the digest and makes the blob visible. Another digest than
        // promised removes what came and throws kDataLoss.
        void Commit();

      private:
        friend class BlobStore;
        Upload(BlobStore* store, std::string sha256, std::uint64_t size);
        void Discard();

        BlobStore* store_;
        std::string sha256_;
        std::uint64_t size_, offset_ = 0;
        int file_ = -1;
        Sha256 sha_;
    };

    // `offset` is at most PartSize; what is there behind it is dropped. Throws kResourceExhausted
    // beyond the quota, kUnavailable while another upload of the same blob runs, kInvalidArgument
    // for a wrong offset.
    std::unique_ptr<Upload> Begin(const std::string& sha256, std::uint64_t size,
                                  std::uint64_t offset);

  private:
    std::filesystem::path PathOf(const std::string& sha256) const;
    std::filesystem::path PartOf(const std::string& sha256) const;

    std::filesystem::path folder_;
    std::uint64_t quota_;

    mutable std::mutex mutex_;  // guards all below
    std::uint64_t used_ = 0;    // bytes on disk, and those that running uploads may still bring
    std::set<std::string> uploading_;
};

}  // namespace relume::store
