#include "server/denoise/planes.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"
#include "server/denoise/convolve_kernels.h"

namespace relume::denoise {
namespace {

constexpr std::size_t kRowGrain = 8;

}  // namespace

Plane Convolve(const Plane& in, int width, int height, const std::vector<float>& taps) {
    const int radius = static_cast<int>(taps.size()) / 2;
    const auto w = static_cast<std::size_t>(width);
    const ConvolveKernel convolve = BestConvolve();
    Plane rows(in.size()), out(in.size());
    ParallelFor(0, static_cast<std::size_t>(height), kRowGrain,
                [&](std::size_t y0, std::size_t y1) {
                    std::vector<float> padded(w + taps.size() - 1, 0.0f);
                    for (std::size_t y = y0; y < y1; ++y) {
                        std::copy_n(in.begin() + static_cast<std::ptrdiff_t>(y * w), w,
                                    padded.begin() + radius);
                        convolve(padded.data(), 1, taps.data(), static_cast<int>(taps.size()),
                                 width, rows.data() + y * w);
                    }
                });
    ParallelFor(0, static_cast<std::size_t>(height), kRowGrain,
                [&](std::size_t y0, std::size_t y1) {
                    for (int y = static_cast<int>(y0); y < static_cast<int>(y1); ++y) {
                        const int first = std::max(y - radius, 0);
                        const int last = std::min(y + radius, height - 1);
                        convolve(rows.data() + static_cast<std::size_t>(first) * w, width,
                                 taps.data() + (first - y + radius), last - first + 1, width,
                                 out.data() + static_cast<std::size_t>(y) * w);
                    }
                });
    return out;
}

std::vector<float> TapSums(int size, const std::vector<float>& taps) {
    const int radius = static_cast<int>(taps.size()) / 2;
    std::vector<float> sums(static_cast<std::size_t>(size), 0.0f);
    for (int i = 0; i < size; ++i) {
        for (int k = std::max(-radius, -i); k <= std::min(radius, size - 1 - i); ++k) {
            sums[static_cast<std::size_t>(i)] += taps[static_cast<std::size_t>(k + radius)];
        }
    }
    return sums;
}

Plane SumBox(const Plane& in, int width, int height, int radius) {
    return Convolve(in, width, height,
                    std::vector<float>(static_cast<std::size_t>(2 * radius + 1), 1.0f));
}

Plane BlurByTaps(const Plane& in, int width, int height, const std::vector<float>& taps) {
    Plane out = Convolve(in, width, height, taps);
    const std::vector<float> across = TapSums(width, taps), down = TapSums(height, taps);
    ParallelFor(0, down.size(), kRowGrain, [&](std::size_t y0, std::size_t y1) {
        for (std::size_t y = y0; y < y1; ++y) {
            float* row = out.data() + y * across.size();
            for (std::size_t x = 0; x < across.size(); ++x) {
                row[x] /= across[x] * down[y];
            }
        }
    });
    return out;
}

std::vector<float> GaussianTaps(float sigma) {
    const int radius = static_cast<int>(std::ceil(3 * sigma));
    std::vector<float> taps;
    for (int k = -radius; k <= radius; ++k) {
        taps.push_back(std::exp(-0.5f * static_cast<float>(k * k) / (sigma * sigma)));
    }
    return taps;
}

Plane BlurGaussian(const Plane& in, int width, int height, float sigma) {
    return BlurByTaps(in, width, height, GaussianTaps(sigma));
}

Plane AverageOfThree(const Plane (&planes)[3]) {
    Plane out(planes[0].size());
    for (std::size_t i = 0; i < out.size(); ++i) {
        out[i] = (planes[0][i] + planes[1][i] + planes[2][i]) * (1.0f / 3.0f);
    }
    return out;
}

}  // namespace relume::denoise
