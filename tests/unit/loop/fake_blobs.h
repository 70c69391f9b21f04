#pragma once

#include <algorithm>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/sha256.h"
#include "core/scene/manifest.h"
#include "worker/loop/blob_cache.h"

namespace relume::worker {

// Blobs to fetch, and a record of what was asked for.
class FakeBlobs {
  public:
    std::string Add(const std::string& bytes) {
        const std::string sha256 = Sha256Hex(bytes);
        blobs_[sha256] = bytes;
        return sha256;
    }
    ManifestEntry AddFile(const std::string& path, const std::string& bytes) {
        return {path, bytes.size(), Add(bytes)};
    }
    // Answers with other bytes than the digest promises.
    void Corrupt(const std::string& sha256, const std::string& bytes) { blobs_[sha256] = bytes; }
    // The next fetches break off after so many bytes of the blob, once each.
    void BreakAfter(std::vector<std::size_t> bytes) { breaks_ = std::move(bytes); }
    // A bit of each of the next so many fetches changes on the way.
    void Mangle(int fetches) { to_mangle_ = fetches; }

    BlobFetch Fetch() {
        return [this](const std::string& sha256, std::uint64_t offset,
                      const std::function<void(const std::string&)>& sink) {
            std::string bytes;
            std::size_t end = std::string::npos;
            {
                const std::lock_guard lock(mutex_);
                asked_.emplace_back(sha256, offset);
                if (blobs_.count(sha256) == 0) {
                    ThrowNotFound("blob is not there");
                }
                bytes = blobs_.at(sha256);
                if (to_mangle_ > 0) {
                    --to_mangle_;
                    bytes.back() = static_cast<char>(bytes.back() ^ 1);
                }
                if (!breaks_.empty()) {
                    end = breaks_.front();
                    breaks_.erase(breaks_.begin());
                }
            }
            constexpr std::size_t kPiece = 100;
            for (std::size_t i = offset; i < std::min(bytes.size(), end); i += kPiece) {
                sink(bytes.substr(i, std::min({kPiece, bytes.size() - i, end - i})));
            }
            if (end < bytes.size()) {
                throw Error(ErrorCode::kUnavailable, "the line is cut");
            }
        };
    }

    // Digest and offset of each fetch.
    std::vector<std::pair<std::string, std::uint64_t>> asked() const {
        const std::lock_guard lock(mutex_);
        return asked_;
    }

  private:
    mutable std::mutex mutex_;  // guards all below
    std::map<std::string, std::string> blobs_;
    std::vector<std::size_t> breaks_;
    int to_mangle_ = 0;
    std::vector<std::pair<std::string, std::uint64_t>> asked_;
};

}  // namespace relume::worker
