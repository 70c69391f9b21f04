#include "server/denoise/net_evidence.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/denoise/each_pixel.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

constexpr int kRadius = 2;        // of the window that relative noise is a mean over
constexpr float kAllowed = 1.5f;  // deviations
constexpr float kLeast = 1e-10f;  // variance: no deviation is divided by 0

// Squared distance of the candidate from the noisy image in the channels where it is brighter.
float SquaredExcess(const Frame& frame, const Result& candidate, std::size_t i) {
    float sum = 0;
    for (int c = 0; c < 3; ++c) {
        const float excess = std::max(0.0f, candidate.color[c][i] - frame.color[c][i]);
        sum += excess * excess;
    }
    return sum;
}

// Variance of the noisy image, sum over the channels.
Plane ExpectedNoise(const Frame& frame, const Result& base) {
    const std::size_t size = frame.pixel_count();
    const Plane level = FillPlane(size, [&](std::size_t i) {
        float sum = kLeast;
        for (const Plane& plane : base.color) {
            sum += plane[i] * plane[i];
        }
        return sum;
    });
    const Plane own = FillPlane(size, [&](std::size_t i) {
        return frame.variance[0][i] + frame.variance[1][i] + frame.variance[2][i];
    });
    const Plane relative = FillPlane(size, [&](std::size_t i) { return own[i] / level[i]; });
    const Plane pooled =
        BlurByTaps(relative, frame.width, frame.height, std::vector<float>(2 * kRadius + 1, 1.0f));
    return FillPlane(
        size, [&](std::size_t i) { return std::max(own[i], pooled[i] * level[i]) + kLeast; });
}

}  // namespace

void HoldToSamples(const Frame& frame, const NetCandidates& candidates,
                   std::array<Plane, kNetSlotCount>* weights) {
    const Plane noise = ExpectedNoise(frame, *candidates[kBilateralSlot]);
    ForEachPixel(frame.pixel_count(), [&](std::size_t i) {
        float sum = (*weights)[0][i];
        for (std::size_t k = 1; k < kNetSlotCount; ++k) {
            if (candidates[k] != nullptr) {
                const float excess = SquaredExcess(frame, *candidates[k], i);
                const float allowed = kAllowed * kAllowed * noise[i];
                if (excess > allowed) {
                    (*weights)[k][i] *= std::sqrt(allowed / excess);
                }
                sum += (*weights)[k][i];
            }
        }
        for (std::size_t k = 0; k < kNetSlotCount; ++k) {
            if (candidates[k] != nullptr) {
                (*weights)[k][i] = sum > 0 ? (*weights)[k][i] / sum : (k == 0 ? 1.0f : 0.0f);
            }
        }
    });
}

}  // namespace relume::denoise
