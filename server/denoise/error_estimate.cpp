#include "server/denoise/error_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/image/metrics.h"
#include "server/denoise/crop_frame.h"
#include "server/denoise/noisy_part.h"
#include "server/denoise/planes.h"
#include "server/denoise/seen_lights.h"
#include "server/denoise/yardstick.h"

namespace relume::denoise {
namespace {

using Rgb = std::array<Plane, 3>;

// Standard deviation of what all pixels share, over the estimate: measured by bench/sampling.
constexpr double kNoisyBias = 0.13, kFilteredBias = 0.12;

// Errors relative to the filtered image's own brightness, not to the truth's, come out too small:
// large ones are mostly of pixels that are too bright. Measured by bench/sampling.
constexpr int kShare = 4;  // of a large frame one part in so many is filtered once more
constexpr float kBrighterWhereWrong = 1.06f;

// `squared`: estimated squared errors a pixel and channel; `yardstick`: what they are relative to.
ErrorEstimate Summarise(const Frame& frame, const Rgb& squared, const Rgb& yardstick,
                        double shared_bias) {
    ErrorEstimate estimate;
    estimate.map.resize(frame.pixel_count());
    double sum = 0, spreads = 0;
    for (std::size_t i = 0; i < estimate.map.size(); ++i) {
        double error = 0, spread = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const double scale = 1 / (3 * (yardstick[c][i] + kRelMSEEpsilon));
            error += squared[c][i] * scale;
            spread += frame.variance[c][i] * scale;
        }
        estimate.map[i] = static_cast<float>(error);
        sum += error;
        spreads += spread * spread;
    }
    if (!estimate.map.empty()) {
        const auto n = static_cast<double>(estimate.map.size());
        estimate.relmse = std::max(0.0, sum / n);
        // A pixel's estimate and its error differ by the product of its halves' errors, whose
        // variance is the square of its own; channels go together.
        const double noise = std::sqrt(spreads) / n, bias = shared_bias * estimate.relmse;
        const double margin = 1.96 * std::sqrt(noise * noise + bias * bias);
        estimate.low = std::max(0.0, estimate.relmse - margin);
        estimate.high = estimate.relmse + margin;
    }
    return estimate;
}

// Whether each half has the samples a pixel that the filter needs.
bool HasForHalves(const Denoiser& denoiser, const Frame& frame) {
    double samples = 0;
    for (const float n : frame.count) {
        samples += HalfCount(n, 1);
    }
    return samples >= denoiser.GetNeeds().min_spp * static_cast<double>(frame.pixel_count());
}

// By the halves of some windows of a large frame, of which some are known: without a map.
ErrorEstimate JudgeParts(const Denoiser& denoiser, const Frame& frame,
                         const std::vector<TileRect>& windows, std::span<const WindowError> known,
                         const CancelToken& cancel) {
    ErrorEstimate estimate;
    const auto n = static_cast<double>(windows.size());
    double sum = 0, squares = 0;
    for (const TileRect& window : windows) {
        const auto found = std::ranges::find(known, window, &WindowError::window);
        WindowError error{};
        if (found != known.end()) {
            error = *found;
        } else {
            const FramePart part = CutPart(frame, window);
            error = JudgeWindow(part, FilterHalves(denoiser, part.frame, cancel));
        }
        sum += error.relmse;
        squares += error.relmse * error.relmse;
        estimate.unfiltered += error.unfiltered / n;
    }
    const double mean = sum / n;
    estimate.relmse = std::max(0.0, mean);
    const double among = std::max(0.0, squares / n - mean * mean) / (n - 1);
    const double bias = kFilteredBias * estimate.relmse;
    const double margin = 1.96 * std::sqrt(among + bias * bias);
    estimate.low = std::max(0.0, estimate.relmse - margin);
    estimate.high = estimate.relmse + margin;
    return estimate;
}

}  // namespace

// That of the halves, where they are there: for one sample that is far out it is what that adds to
// the squared error, so that the two cancel.
std::array<Plane, 3> VarianceByHalves(const Frame& frame) {
    Rgb noise{frame.variance[0], frame.variance[1], frame.variance[2]};
    for (std::size_t c = 0; c < 3 && frame.has_halves(); ++c) {
        for (std::size_t i = 0; i < noise[c].size(); ++i) {
            const float n = frame.count.empty() ? 2 : frame.count[i];
            const float delta = frame.half[0][c][i] - frame.half[1][c][i];
            noise[c][i] =
                n > 1 ? delta * delta * HalfCount(n, 1) * HalfCount(n, 0) / (n * n) : noise[c][i];
        }
    }
    return noise;
}

// The halves' errors are independent, so that their product, unlike a square, is on average what it
// would be without any. Where they are far apart it says little: the surroundings' mean is taken
// there if that is more.
std::array<Plane, 3> FilteredYardstick(const FilteredHalves& halves, int width, int height) {
    constexpr int kAround = 2;  // radius, pixels
    Rgb squares;
    const Plane inside = SumBox(Plane(halves.color[0][0].size(), 1.0f), width, height, kAround);
    for (std::size_t c = 0; c < 3; ++c) {
        const Plane &a = halves.color[0][c], &b = halves.color[1][c];
        squares[c].resize(a.size());
        for (std::size_t i = 0; i < a.size(); ++i) {
            squares[c][i] = std::max(0.0f, a[i] * b[i]);
        }
        const Plane around = SumBox(squares[c], width, height, kAround);
        for (std::size_t i = 0; i < a.size(); ++i) {
            const float d = a[i] - b[i];
            if (d * d > squares[c][i]) {
                squares[c][i] = std::max(squares[c][i], around[i] / inside[i]);
            }
        }
    }
    return squares;
}

ErrorEstimate EstimateNoisy(const Frame& frame) {
    return Summarise(frame, VarianceByHalves(frame), SquaredYardstick(frame), kNoisyBias);
}

ErrorEstimate JudgeHalves(const Frame& frame, const FilteredHalves& halves) {
    const Rgb noise = VarianceByHalves(frame);
    Rgb yardstick = FilteredYardstick(halves, frame.width, frame.height);
    Rgb squared = HalvesError(frame, halves, noise);
    // Lights that the camera sees stay as they are, and their halves are too different.
    const std::vector<unsigned char> lights = FindSeenLights(frame);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            squared[c][i] *= kBrighterWhereWrong;
            if (!lights.empty() && lights[i] != 0) {
                squared[c][i] = noise[c][i];
                yardstick[c][i] = frame.color[c][i] * frame.color[c][i];
            }
        }
    }
    ErrorEstimate estimate = Summarise(frame, squared, yardstick, kFilteredBias);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            estimate.unfiltered += noise[c][i] / (3 * (yardstick[c][i] + kRelMSEEpsilon)) /
                                   static_cast<double>(frame.pixel_count());
        }
    }
    return estimate;
}

WindowError JudgeWindow(const FramePart& part, const FilteredHalves& halves) {
    const ErrorEstimate whole = JudgeHalves(part.frame, halves);
    double mean = 0;
    const Plane inner = CropPlane(whole.map, part.frame.width, part.inner);
    for (const float e : inner) {
        mean += e / static_cast<double>(inner.size());
    }
    const TileRect &in = part.inner, &out = part.outer;
    return {
        {out.x0 + in.x0, out.y0 + in.y0, out.x0 + in.x1, out.y0 + in.y1}, mean, whole.unfiltered};
}

std::vector<TileRect> WindowsToJudge(const Frame& frame) { return ChooseWindows(frame, kShare); }

std::optional<ErrorEstimate> EstimateByHalves(const Denoiser& denoiser, const Frame& frame,
                                              const CancelToken& cancel,
                                              std::span<const WindowError> known) {
    if (!frame.has_halves() || denoiser.GetNeeds().halves) {
        return std::nullopt;
    }
    if (const Denoiser* const inner = denoiser.OfNoisyPart()) {
        const TileRect rect = FindNoisyPart(frame);
        if (IsWhole(rect, frame)) {
            return EstimateByHalves(*inner, frame, cancel, known);
        }
        const auto estimate = EstimateByHalves(*inner, CropFrame(frame, rect), cancel, known);
        return estimate ? std::optional(ExpandEstimate(*estimate, rect, frame)) : std::nullopt;
    }
    if (denoiser.GetNeeds().samples) {  // which parts don't have
        return HasForHalves(denoiser, frame)
                   ? std::optional(JudgeHalves(frame, FilterHalves(denoiser, frame, cancel)))
                   : std::nullopt;
    }
    const std::vector<TileRect> windows = WindowsToJudge(frame);
    return windows.size() > 1 ? JudgeParts(denoiser, frame, windows, known, cancel)
                              : JudgeHalves(frame, FilterHalves(denoiser, frame, cancel));
}

void AddMap(const Frame& frame, const Result& result, ErrorEstimate* estimate) {
    if (!estimate->map.empty()) {
        return;
    }
    estimate->map.assign(frame.pixel_count(), static_cast<float>(estimate->relmse));
    if (!result.error) {
        return;
    }
    double sum = 0;
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        float square = 0;
        for (const Plane& plane : result.color) {
            square += plane[i] * plane[i] * (1.0f / 3.0f);
        }
        estimate->map[i] =
            std::max(0.0f, (*result.error)[i]) / (square + static_cast<float>(kRelMSEEpsilon));
        sum += estimate->map[i];
    }
    const double scale =
        sum > 0 ? estimate->relmse * static_cast<double>(frame.pixel_count()) / sum : 0;
    for (float& e : estimate->map) {
        e = static_cast<float>(e * scale);
    }
}

std::optional<ErrorEstimate> EstimateChosen(const Choice& choice, const Frame& frame,
                                            const CancelToken& cancel) {
    if (!choice.base) {
        return std::nullopt;
    }
    auto estimate = choice.base_error
                        ? std::optional(*choice.base_error)
                        : EstimateByHalves(*choice.base, frame, cancel, choice.base_windows);
    if (estimate) {
        const double ratio = choice.over_base;
        const double spread = 1.96 * choice.over_base_error * estimate->relmse;
        const double margin = std::hypot(ratio * (estimate->high - estimate->relmse), spread);
        estimate->relmse *= ratio;
        estimate->low = std::max(0.0, estimate->relmse - margin);
        estimate->high = estimate->relmse + margin;
        for (float& e : estimate->map) {
            e *= static_cast<float>(ratio);
        }
    }
    return estimate;
}

std::optional<ErrorEstimate> EstimateFiltered(const Denoiser& denoiser, const Frame& frame,
                                              const Result& result, const CancelToken& cancel) {
    if (auto estimate = EstimateByHalves(denoiser, frame, cancel)) {
        AddMap(frame, result, &*estimate);
        return estimate;
    }
    if (!result.derivative) {
        return std::nullopt;
    }
    Rgb squared = VarianceByHalves(frame);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < squared[c].size(); ++i) {
            const float residual = result.color[c][i] - frame.color[c][i];
            squared[c][i] =
                residual * residual + squared[c][i] * (2 * (*result.derivative)[c][i] - 1);
        }
    }
    return Summarise(frame, squared, SquaredYardstick(frame), kFilteredBias);
}

void WriteClaim(const std::string& key, const ErrorEstimate* estimate,
                std::map<std::string, std::string>* metadata) {
    metadata->erase(key);
    metadata->erase(key + "_interval");
    if (estimate != nullptr) {
        (*metadata)[key] = fmt::format("{:.6g}", estimate->relmse);
        (*metadata)[key + "_interval"] =
            fmt::format("{:.6g} {:.6g}", estimate->low, estimate->high);
    }
}

}  // namespace relume::denoise
