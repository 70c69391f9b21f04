#pragma once

#include <map>
#include <string>

#include "core/scene/formats.h"
#include "core/scene/manifest.h"
#include "worker/loop/blob_cache.h"

namespace relume::worker {

// A scene's files, read from the cache by the digests of its manifest. Thread-safe.
class ManifestSource final : public FileSource {
  public:
    // `cache` outlives the object.
    ManifestSource(const SceneManifest& manifest, BlobCache* cache, BlobFetch fetch);

    // Fetches what the cache lacks, several blobs at once.
    void FetchAll() const;

    std::string Read(const std::string& name) const override;

  private:
    std::map<std::string, ManifestEntry> entries_;
    BlobCache* cache_;
    BlobFetch fetch_;
};

}  // namespace relume::worker
