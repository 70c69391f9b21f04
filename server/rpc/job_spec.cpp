#include "server/rpc/job_spec.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "proto/codec/budgets.h"
#include "proto/codec/codec.h"
#include "server/denoise/denoiser.h"
#include "server/rpc/filter_loop.h"

namespace relume::server {
namespace {

constexpr int kMinTileSize = 8, kDefaultTileSize = 32;
constexpr std::size_t kMaxDisplayName = 200;
// Film, planner, and the filter's frame and layers at the same time.
constexpr std::uint64_t kBytesPerPixel = 600;

void CheckMemory(const RenderSettings& settings) {
    const std::uint64_t needed = settings.Window().area() * kBytesPerPixel;
    const std::uint64_t memory = static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
                                 static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    if (needed > memory) {
        throw Error(
            ErrorCode::kResourceExhausted,
            fmt::format("{}x{} pixels need about {} GB, the server has {} GB; choose a smaller "
                        "--size or --crop",
                        settings.Window().width(), settings.Window().height(), needed >> 30,
                        memory >> 30));
    }
}

void CheckBlobs(const SceneManifest& manifest, const store::BlobStore& blobs) {
    for (const auto& entry : manifest.entries) {
        if (!blobs.Has(entry.sha256)) {
            throw Error(ErrorCode::kFailedPrecondition,
                        fmt::format("scene file '{}' ({}) is not on the server; upload it first",
                                    entry.path, entry.sha256));
        }
        if (const std::uint64_t size = blobs.SizeOf(entry.sha256); size != entry.size) {
            ThrowInvalidArgument(fmt::format("scene file '{}' is said to have {} bytes, it has {}",
                                             entry.path, entry.size, size));
        }
    }
}

jobs::Budgets BudgetsOf(const v1::JobSpec& spec, const TileRect& window) {
    codec::CheckBudgets(spec);
    jobs::Budgets budgets;
    if (spec.spp() > 0) {
        budgets.samples = static_cast<std::uint64_t>(
            std::llround(spec.spp() * static_cast<double>(window.area())));
        if (*budgets.samples == 0) {
            ThrowInvalidArgument(
                fmt::format("spp {}: less than one sample in the whole image", spec.spp()));
        }
    }
    budgets.min_spp = spec.min_spp();
    if (spec.has_max_spp()) {
        budgets.max_spp = spec.max_spp();
    }
    if (spec.has_target()) {
        budgets.target = spec.target();
    }
    if (spec.has_time_limit()) {
        budgets.seconds = spec.time_limit();
    }
    return budgets;
}

// Of a time limit, for the filter that chooses.
constexpr double kFilterShare = 0.1;

}  // namespace

CheckedSpec CheckSpec(const v1::JobSpec& spec, const store::BlobStore& blobs) {
    CheckedSpec checked;
    checked.message = spec;
    checked.settings = codec::FromProto(spec.settings());
    checked.manifest = codec::FromProto(spec.scene());
    const std::string& environment = checked.settings.environment;
    if (!environment.empty() &&
        std::none_of(checked.manifest.entries.begin(), checked.manifest.entries.end(),
                     [&](const ManifestEntry& entry) { return entry.path == environment; })) {
        ThrowInvalidArgument(
            fmt::format("the environment '{}' is not among the scene's files", environment));
    }

    checked.budgets = BudgetsOf(spec, checked.settings.Window());

    checked.tile_size = spec.tile_size() == 0 ? kDefaultTileSize : spec.tile_size();
    if (checked.tile_size < kMinTileSize || checked.tile_size > codec::kMaxTileSide) {
        ThrowInvalidArgument(fmt::format("tile size {}: must be {} to {}", spec.tile_size(),
                                         kMinTileSize, codec::kMaxTileSide));
    }
    if (spec.display_name().size() > kMaxDisplayName) {
        ThrowInvalidArgument(
            fmt::format("the job's display name is longer than {} bytes", kMaxDisplayName));
    }

    const auto planner =
        jobs::MakePlanner(spec.sampler().empty() ? kDefaultSampler : spec.sampler());
    checked.sampler = planner->Describe();
    const auto denoiser =
        denoise::MakeDenoiser(spec.filter().empty() ? kDefaultFilter : spec.filter());
    checked.filter = denoiser->Describe();
    if (checked.budgets.seconds && checked.filter == "auto") {
        checked.filter =
            fmt::format("auto:seconds={:.3g}", kFilterShare * *checked.budgets.seconds);
    }

    CheckMemory(checked.settings);
    CheckBlobs(checked.manifest, blobs);
    return checked;
}

jobs::JobSetup CheckedSpec::Setup() const {
    jobs::JobSetup setup;
    setup.window = settings.Window();
    setup.display_width = settings.width;
    setup.display_height = settings.height;
    setup.tile_size = tile_size;
    setup.budgets = budgets;
    setup.planner = jobs::MakePlanner(sampler);
    const char* method = setup.planner->Method();
    setup.guide = method != nullptr ? MakeMethodGuide(method) : MakeGuide(filter);
    setup.estimators.error = MakeErrorEstimator(filter);
    setup.estimators.filtered = filter != "none";
    return setup;
}

}  // namespace relume::server
