#include "worker/loop/manifest_source.h"

#include <fmt/format.h>

#include <atomic>
#include <future>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace relume::worker {
namespace {

constexpr int kTransfers = 4;  // small files wait for round trips, not for the wire

}  // namespace

ManifestSource::ManifestSource(const SceneManifest& manifest, BlobCache* cache, BlobFetch fetch)
    : cache_(cache), fetch_(std::move(fetch)) {
    for (const auto& entry : manifest.entries) {
        entries_[entry.path] = entry;
    }
}

void ManifestSource::FetchAll() const {
    std::vector<const ManifestEntry*> wanted;
    for (const auto& [path, entry] : entries_) {
        wanted.push_back(&entry);
    }
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
        for (std::size_t i; (i = next++) < wanted.size();) {
            try {
                cache_->Ensure(wanted[i]->sha256, wanted[i]->size, fetch_);
            } catch (...) {
                next = wanted.size();
                throw;
            }
        }
    };
    std::vector<std::future<void>> transfers;
    for (int i = 0; i < kTransfers; ++i) {
        transfers.push_back(std::async(std::launch::async, work));
    }
    std::exception_ptr problem;
    for (auto& transfer : transfers) {
        try {
            transfer.get();
        } catch (...) {
            problem = std::current_exception();
        }
    }
    if (problem) {
        std::rethrow_exception(problem);
    }
}

std::string ManifestSource::Read(const std::string& name) const {
    const auto it = entries_.find(name);
    if (it == entries_.end()) {
        ThrowNotFound(
            fmt::format("{}: is not among the scene's files; submit the scene again", name));
    }
    return cache_->Read(it->second.sha256, it->second.size, fetch_);
}

}  // namespace relume::worker
