#include "server/rpc/job_spec.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/resources.h"
#include "proto/codec/budgets.h"
#include "proto/codec/codec.h"
#include "server/denoise/denoiser.h"
#include "server/jobs/fair_share.h"
#include "server/rpc/filter_loop.h"

namespace relume::server {
namespace {

constexpr int kMinTileSize = 8, kDefaultTileSize = 32;
constexpr std::size_t kMaxDisplayName = 200, kMaxOwner = 64, kMaxGroup = 100;
// Film, planner, and the filter's frame and layers at the same time.
constexpr std::uint64_t kBytesPerPixel = 600;
constexpr std::uint64_t kFilmBytesPerPixel = 200;                  // and the planner's
constexpr std::uint64_t kMaxSampleBytes = std::uint64_t{4} << 30;  // of a job that keeps them

// `kept`: bytes of the samples that the job keeps. The filter has a half of them once more, and for
// each a pointer and two colours.
void CheckMemory(const RenderSettings& settings, std::uint64_t kept) {
    const std::uint64_t needed =
        settings.Window().area() * kBytesPerPixel + kept + kept / 2 + kept / 3;
    const std::uint64_t memory = AvailableResources().memory;
    if (needed > memory) {
        throw Error(
            ErrorCode::kResourceExhausted,
            fmt::format("{}x{} pixels need about {} GB, the server has {} GB; choose a smaller "
                        "--size or --crop, or give the server more memory",
                        settings.Window().width(), settings.Window().height(), needed >> 30,
                        memory >> 30));
    }
}

// Of a job that keeps its samples; it gets as many as the filter needs at least. Answers with their
// bytes, 0 if it keeps none.
std::uint64_t CheckSamples(const v1::JobSpec& spec, const denoise::Denoiser& denoiser,
                           jobs::Budgets* budgets, std::size_t pixels) {
    const denoise::Needs needs = denoiser.GetNeeds();
    if (needs.samples != spec.keep_samples()) {
        ThrowInvalidArgument(
            needs.samples
                ? fmt::format("filter '{}' needs the samples themselves: render with "
                              "--keep-samples",
                              denoiser.Describe())
                : fmt::format("filter '{}' does not look at the samples themselves: leave "
                              "--keep-samples out, or choose --filter rpf",
                              denoiser.Describe()));
    }
    if (!spec.keep_samples()) {
        return 0;
    }
    if (budgets->seconds) {
        ThrowInvalidArgument(
            fmt::format("filter '{}' takes a time that can't be told ahead: give --spp or --target "
                        "instead of --time-limit",
                        denoiser.Describe()));
    }
    const double cap = jobs::PixelCap(*budgets);
    const double spp = budgets->samples ? std::min(spec.spp(), cap) : cap;
    if (spp < needs.min_spp) {
        ThrowInvalidArgument(
            fmt::format("filter '{}' needs {} samples a pixel; choose a larger "
                        "--spp or --max-spp",
                        denoiser.Describe(), needs.min_spp));
    }
    budgets->min_spp = std::max(budgets->min_spp, static_cast<std::uint32_t>(needs.min_spp));
    const double bytes = spp * static_cast<double>(pixels) * sizeof(SampleRecord);
    if (bytes > static_cast<double>(kMaxSampleBytes)) {
        throw Error(
            ErrorCode::kResourceExhausted,
            fmt::format("--keep-samples: {} pixels of up to {:.6g} samples need {:.1f} GiB, "
                        "{} are the most; choose a smaller --size, --crop, --spp or --max-spp",
                        pixels, spp, bytes / (1 << 30), kMaxSampleBytes >> 30));
    }
    return static_cast<std::uint64_t>(bytes);
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
// Of `auto` where a job does not say (server/denoise/auto.cpp).
constexpr double kFilterEffort = 0.6;

}  // namespace

CheckedSpec CheckSpec(const v1::JobSpec& spec, const store::BlobStore& blobs) {
    CheckedSpec checked;
    checked.message = spec;
    checked.caller = spec.owner();
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
    if (spec.priority() < jobs::kMinPriority || spec.priority() > jobs::kMaxPriority) {
        ThrowInvalidArgument(fmt::format("priority {}: must be {} to {}", spec.priority(),
                                         jobs::kMinPriority, jobs::kMaxPriority));
    }
    if (spec.owner().size() > kMaxOwner) {
        ThrowInvalidArgument(fmt::format("the job's owner is longer than {} bytes", kMaxOwner));
    }
    if (spec.display_name().size() > kMaxDisplayName) {
        ThrowInvalidArgument(
            fmt::format("the job's display name is longer than {} bytes", kMaxDisplayName));
    }
    if (spec.group().size() > kMaxGroup) {
        ThrowInvalidArgument(
            fmt::format("the name of the job's group is longer than {} bytes", kMaxGroup));
    }

    const auto planner =
        jobs::MakePlanner(spec.sampler().empty() ? kDefaultSampler : spec.sampler());
    checked.sampler = planner->Describe();
    const auto denoiser =
        denoise::MakeDenoiser(spec.filter().empty() ? kDefaultFilter : spec.filter());
    checked.filter = denoiser->Describe();
    if (spec.filter().empty() || spec.filter() == kDefaultFilter) {
        checked.filter = fmt::format("auto:effort={:.3g}", kFilterEffort);
        if (checked.budgets.seconds) {
            checked.filter +=
                fmt::format(",seconds={:.3g}", kFilterShare * *checked.budgets.seconds);
        }
    }

    const std::uint64_t kept =
        CheckSamples(spec, *denoiser, &checked.budgets, checked.settings.Window().area());

    CheckMemory(checked.settings, kept);
    checked.memory = checked.settings.Window().area() * kFilmBytesPerPixel + kept;
    CheckBlobs(checked.manifest, blobs);
    return checked;
}

jobs::JobSetup CheckedSpec::Setup() const {
    jobs::JobSetup setup;
    setup.window = settings.Window();
    setup.display_width = settings.width;
    setup.display_height = settings.height;
    setup.tile_size = tile_size;
    setup.keep_samples = message.keep_samples();
    setup.memory = memory;
    setup.owner = message.owner();
    setup.priority = message.priority();
    setup.budgets = budgets;
    setup.planner = jobs::MakePlanner(sampler);
    const char* method = setup.planner->Method();
    setup.guide = method != nullptr ? MakeMethodGuide(method) : MakeGuide(filter);
    setup.estimators = MakeErrorEstimator(filter);
    setup.estimators.filtered = filter != "none";
    return setup;
}

}  // namespace relume::server
