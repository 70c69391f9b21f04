#pragma once

#include <cstdint>

#include "core/scene/manifest.h"
#include "core/scene/render_settings.h"
#include "relume/v1/jobs.pb.h"
#include "server/jobs/budget.h"
#include "server/jobs/job.h"
#include "server/store/blob_store.h"

namespace relume::server {

inline constexpr const char* kDefaultSampler = "adaptive";
inline constexpr const char* kDefaultFilter = "auto";

// A JobSpec that can be rendered.
struct CheckedSpec {
    v1::JobSpec message;  // as the client gave it
    std::string caller;   // who asked for it, for quotas: its owner, unless that was only said
    SceneManifest manifest;
    RenderSettings settings;
    std::string sampler, filter;  // with all parameters
    int tile_size = 32;
    jobs::Budgets budgets;
    std::uint64_t memory = 0;  // bytes, as JobSetup's

    jobs::JobSetup Setup() const;
};

// Throws what is wrong: kInvalidArgument; kResourceExhausted if the film can't fit this machine's
// memory; kFailedPrecondition, last of all, if a file of the scene is not in `blobs` yet.
CheckedSpec CheckSpec(const v1::JobSpec& spec, const store::BlobStore& blobs);

}  // namespace relume::server
