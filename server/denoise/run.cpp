#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "server/denoise/cancelled.h"
#include "server/denoise/denoiser.h"

namespace relume::denoise {
namespace {

void CheckNeeds(const Denoiser& denoiser, const Frame& frame) {
    const Needs needs = denoiser.GetNeeds();
    if (needs.samples && !frame.samples && frame.pixel_count() > 0) {
        throw Error(ErrorCode::kFailedPrecondition,
                    fmt::format("filter '{}' needs the samples themselves: render with "
                                "--keep-samples",
                                denoiser.Describe()));
    }
    if (needs.halves && !frame.has_halves()) {
        throw Error(
            ErrorCode::kFailedPrecondition,
            fmt::format(
                "filter '{}' needs the means of the two halves (buffer_a, buffer_b), which the "
                "image lacks",
                denoiser.Describe()));
    }
    for (const int f : needs.features) {
        if (frame.feature[f].empty()) {
            throw Error(ErrorCode::kFailedPrecondition,
                        fmt::format("filter '{}' needs the feature {}, which the image lacks",
                                    denoiser.Describe(), FeatureName(f)));
        }
    }
    double samples = 0;
    for (const float count : frame.count) {
        samples += count;
    }
    const double spp = frame.count.empty() ? 0 : samples / static_cast<double>(frame.count.size());
    if (frame.pixel_count() > 0 && needs.min_spp > 1 && spp < needs.min_spp) {
        throw Error(ErrorCode::kFailedPrecondition,
                    fmt::format("filter '{}' needs {} samples a pixel; the image has {:.3g}",
                                denoiser.Describe(), needs.min_spp, spp));
    }
}

}  // namespace

Result RunDenoiser(const Denoiser& denoiser, const Frame& frame, const CancelToken& cancel) {
    CheckNeeds(denoiser, frame);
    ThrowIfCancelled(cancel);
    Result result = denoiser.Reconstruct(frame, cancel);
    ThrowIfCancelled(cancel);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        bool finite = true;
        for (const Plane& plane : result.color) {
            finite = finite && std::isfinite(plane[i]);
        }
        if (!finite) {
            for (int c = 0; c < 3; ++c) {
                result.color[c][i] = frame.color[c][i];
            }
        }
        // Linear fits swing below black beside what is bright, and rpf takes too much from
        // fireflies.
        for (std::size_t c = 0; c < 3; ++c) {
            const float least = std::min(frame.color[c][i], 0.0f);
            if (result.color[c][i] < least) {
                result.color[c][i] = least;
                if (result.derivative) {
                    (*result.derivative)[c][i] = 0;
                }
            }
        }
        for (std::size_t c = 0; c < 3 && result.derivative; ++c) {
            float& derivative = (*result.derivative)[c][i];
            derivative = finite && std::isfinite(derivative) ? derivative : 1.0f;
        }
        if (result.error && !(finite && std::isfinite((*result.error)[i]))) {
            (*result.error)[i] =
                (frame.variance[0][i] + frame.variance[1][i] + frame.variance[2][i]) *
                (1.0f / 3.0f);
        }
    }
    return result;
}

}  // namespace relume::denoise
