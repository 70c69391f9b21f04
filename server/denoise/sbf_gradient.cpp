// sbf-gradient: SBF that also compares gradients, the "improved SBF" of Xing, Chen, Li 2020 (Fig.
// 11, equations 10 and 11; methods 2.4, 3.5, 3.6). What the paper leaves open:
//
// The gradient is that of the grey image filtered by the smallest window of `bilateral` (features
// alone): that of the noisy image is mostly noise. In units of the frame's steepest gradients (99th
// percentile), with the variance that the filter leaves it. The feature's sigma_g is 1, or 1/2, or
// it has no say: each pixel takes the best of these for each of the seven windows, as SBF judges,
// since a feature made of colours keeps some of their noise.
//
// Limits: risks count weights as free of the noise, which those of the gradient are not quite.
#include "server/denoise/sbf_gradient.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"
#include "server/denoise/bilateral_bank.h"

namespace relume::denoise {
namespace {

constexpr float kGradientSigma = 1;

// The 99th percentile's next power of two: where the frame's gradients end, in steps so large that
// one bad sample has no say in it.
float GradientScale(Plane magnitude) {
    if (magnitude.empty()) {
        return 1;
    }
    const auto place = magnitude.begin() + static_cast<std::ptrdiff_t>(magnitude.size() * 99 / 100);
    std::nth_element(magnitude.begin(), place, magnitude.end());
    return *place > 1e-30f ? std::exp2(std::ceil(std::log2(*place))) : 1;
}

}  // namespace

Gradient SobelGradient(const Plane& values, const Plane& variance, int width, int height) {
    Gradient out;
    out.magnitude.resize(values.size());
    out.variance.resize(values.size());
    ParallelFor(0, static_cast<std::size_t>(height), 8, [&](std::size_t y0, std::size_t y1) {
        for (int y = static_cast<int>(y0); y < static_cast<int>(y1); ++y) {
            for (int x = 0; x < width; ++x) {
                const auto index = [&](int dx, int dy) {
                    const int u = std::clamp(x + dx, 0, width - 1);
                    const int v = std::clamp(y + dy, 0, height - 1);
                    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                           static_cast<std::size_t>(u);
                };
                float across = 0, down = 0, across_variance = 0, down_variance = 0;
                for (int k = -1; k <= 1; ++k) {
                    const float weight = k == 0 ? 2 : 1;
                    across += weight * (values[index(1, k)] - values[index(-1, k)]);
                    down += weight * (values[index(k, 1)] - values[index(k, -1)]);
                    across_variance +=
                        weight * weight * (variance[index(1, k)] + variance[index(-1, k)]);
                    down_variance +=
                        weight * weight * (variance[index(k, 1)] + variance[index(k, -1)]);
                }
                const std::size_t i = index(0, 0);
                const float squared = across * across + down * down;
                const float floor = std::max(across_variance + down_variance, 1e-30f);
                out.magnitude[i] = std::sqrt(squared);
                out.variance[i] =
                    (across * across * across_variance + down * down * down_variance) /
                    std::max(squared, floor);
            }
        }
    });
    return out;
}

void AddGradientGuide(const Frame& frame, const CancelToken& cancel, SbfGuides* guides) {
    const FilteredColors filtered =
        FilterBySmallest(frame, MakeBankGuides(frame), MakeBankTables(), BestKernels(), cancel);
    Plane grey(frame.pixel_count()), variance(frame.pixel_count());
    for (std::size_t i = 0; i < grey.size(); ++i) {
        float deviation = 0;  // the channels' noises go together
        for (std::size_t c = 0; c < 3; ++c) {
            grey[i] += filtered.color[c][i] * (1.0f / 3.0f);
            deviation += std::sqrt(filtered.variance[c][i]) * (1.0f / 3.0f);
        }
        variance[i] = deviation * deviation;
    }
    Gradient gradient = SobelGradient(grey, variance, frame.width, frame.height);
    const float scale = 1 / GradientScale(gradient.magnitude);
    for (std::size_t i = 0; i < grey.size(); ++i) {
        gradient.magnitude[i] *= scale;
        gradient.variance[i] *= scale * scale;
    }
    NormaliseSbfGuide(kGradientSigma, &gradient.magnitude, &gradient.variance);
    guides->gradient = std::move(gradient.magnitude);
    guides->gradient_spread = std::move(gradient.variance);
    guides->names += guides->names.empty() ? "gradient" : ", gradient";
}

}  // namespace relume::denoise
