#include "server/jobs/check_result.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/clones.h"
#include "core/base/error.h"
#include "core/film/aov.h"

namespace relume::jobs {
namespace {

constexpr double kMaxSeconds = 1e6;  // thread time of a lease
// Paths have up to 1024 segments; a few rays go to lights and through glass from each.
constexpr std::uint64_t kMaxRaysPerSample = 1'000'000;

bool IsSquareSum(int channel) {
    return (channel >= kM2A && channel < kM2B + 3) || channel >= kFeatureM2 ||
           channel == kMaxLuminance;
}

// Whether all of a plane is finite and at least `least`. Comparisons with a NaN are false.
RELUME_CLONES bool AllWithin(const float* __restrict plane, std::size_t n, float least) {
    constexpr float kLargest = std::numeric_limits<float>::max();
    unsigned within = 1;
    for (std::size_t k = 0; k < n; ++k) {
        within &=
            static_cast<unsigned>(plane[k] >= least) & static_cast<unsigned>(plane[k] <= kLargest);
    }
    return within != 0;
}

}  // namespace

void CheckResult(const TileTask& task, const TileResult& result) {
    if (result.rect != task.rect || result.pixels.size() != task.ActivePixels() ||
        result.planes.size() != result.pixels.size() * kFilmChannelCount) {
        ThrowInvalidArgument(fmt::format(
            "holds {} pixels and {} values, {} pixels of {} values are due", result.pixels.size(),
            result.planes.size(), task.ActivePixels(), static_cast<int>(kFilmChannelCount)));
    }
    if (!(result.seconds >= 0 && result.seconds <= kMaxSeconds)) {  // NaN, too
        ThrowInvalidArgument(
            fmt::format("says that it took {} s; 0 to {} can be", result.seconds, kMaxSeconds));
    }
    if (result.rays / kMaxRaysPerSample > task.TotalSamples()) {
        ThrowInvalidArgument(fmt::format("says that it traced {} rays for {} samples", result.rays,
                                         task.TotalSamples()));
    }
    const std::size_t n = result.pixels.size();
    for (int channel = 0; channel < kFilmChannelCount; ++channel) {
        const float* plane = result.planes.data() + static_cast<std::size_t>(channel) * n;
        const float least = IsSquareSum(channel) ? 0 : std::numeric_limits<float>::lowest();
        if (AllWithin(plane, n, least)) {
            continue;
        }
        for (std::size_t k = 0; k < n; ++k) {
            if (!std::isfinite(plane[k]) || (IsSquareSum(channel) && plane[k] < 0)) {
                ThrowInvalidArgument(
                    fmt::format("pixel {} has {} = {}", k,
                                FilmChannelNames()[static_cast<std::size_t>(channel)], plane[k]));
            }
        }
    }
    const std::uint64_t due = task.keep_samples ? task.TotalSamples() : 0;
    if (result.samples.size() != due) {
        ThrowInvalidArgument(
            fmt::format("comes with {} samples, {} are due", result.samples.size(), due));
    }
    auto record = result.samples.begin();
    std::size_t k = 0;
    for (std::size_t i = 0; i < task.count.size(); ++i) {
        if (task.count[i] == 0) {
            continue;
        }
        if (result.pixels[k] != i) {
            ThrowInvalidArgument(
                fmt::format("holds pixel {} where {} is due", result.pixels[k], i));
        }
        const float a = result.planes[kCountA * n + k], b = result.planes[kCountB * n + k];
        const float bad = result.planes[kBadCount * n + k];
        // Even indices of [first, first + count) feed half a.
        const std::uint32_t even = (task.count[i] + (task.first[i] % 2 == 0 ? 1 : 0)) / 2;
        const std::uint32_t odd = task.count[i] - even;
        if (a < 0 || b < 0 || bad < 0 || a != std::floor(a) || b != std::floor(b) ||
            a > static_cast<float>(even) || b > static_cast<float>(odd) ||
            a + b + bad != static_cast<float>(task.count[i])) {
            ThrowInvalidArgument(
                fmt::format("pixel {} counts {} + {} samples and {} bad ones, {} + {} are due", k,
                            a, b, bad, even, odd));
        }
        if (task.keep_samples) {
            const auto end = record + task.count[i];
            if (std::count_if(record, end, [](const SampleRecord& r) { return r.bad(); }) !=
                static_cast<std::ptrdiff_t>(bad)) {
                ThrowInvalidArgument(
                    fmt::format("pixel {} counts {} bad samples, but comes with others", k, bad));
            }
            record = end;
        }
        ++k;
    }
}

}  // namespace relume::jobs
