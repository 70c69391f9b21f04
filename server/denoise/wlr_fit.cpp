#include "server/denoise/wlr_fit.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/denoise/bilateral_tiles.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

// No sum overflows.
constexpr float kLargestColor = 1e12f, kLargestVariance = 1e10f, kLargestFeature = 1e4f;

float Bounded(float value, float largest) {
    return value > -largest ? (value < largest ? value : largest) : -largest;
}

struct Group {
    int first, count;
};
constexpr Group kGroups[3] = {{kDepth, 1}, {kNormalX, 3}, {kAlbedoR, 3}};

// Calls body(task, area) for every tile, `task` without what the kernels write.
void ForEachWlrTile(const WlrInput& input, int radius, const CancelToken& cancel,
                    const std::function<void(const WlrTile&, const TileArea&)>& body) {
    Frame size;
    size.width = input.width;
    size.height = input.height;
    ForEachTile(size, kWlrPlanes, radius, cancel, [&](const TileArea& area, TilePlanes& planes) {
        for (int p = 0; p < kWlrPlanes; ++p) {
            planes.Load(p, input.plane[p], input.width, input.height, area.x0, area.y0, 0);
        }
        AlignedFloats scratch(kWlrScratch);
        body({planes.planes(), planes.stride(), area.height, radius, scratch.data()}, area);
    });
}

}  // namespace

WlrInput MakeWlrInput(const Frame& frame) {
    const std::size_t pixels = frame.pixel_count();
    WlrInput input;
    input.width = frame.width;
    input.height = frame.height;
    input.count = frame.count;
    for (std::size_t c = 0; c < 3; ++c) {
        input.plane[kWlrColor + c] = frame.color[c];
        for (float& value : input.plane[kWlrColor + c]) {
            value = Bounded(value, kLargestColor);
        }
    }
    float farthest = 0;
    for (const float z : frame.feature[kDepth]) {
        farthest = std::max(farthest, z);
    }
    int column = kWlrFeature;
    for (int g = 0; g < 3; ++g) {
        const float scale = g > 0 ? 1 : farthest > 0 ? 1 / farthest : 0;
        Plane& noise = input.plane[kWlrNoise + g];
        noise.assign(pixels, 0.0f);
        for (int f = kGroups[g].first; f < kGroups[g].first + kGroups[g].count; ++f, ++column) {
            Plane& plane = input.plane[column];
            plane = frame.feature[f];
            plane.resize(pixels);
            for (float& value : plane) {
                value = Bounded(value * scale, kLargestFeature);
            }
            const Plane& variance = frame.feature_variance[f];
            for (std::size_t i = 0; i < variance.size(); ++i) {
                const float n = frame.count.empty() ? 1 : std::max(frame.count[i], 1.0f);
                noise[i] += Bounded(variance[i] * scale * scale, 1) / n;
            }
        }
    }
    input.plane[kWlrGrey] = AverageOfThree({input.plane[0], input.plane[1], input.plane[2]});
    input.plane[kWlrVariance] = AverageOfThree(frame.variance);
    input.plane[kWlrDeviation].resize(pixels);
    input.plane[kWlrTrust].resize(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        float& variance = input.plane[kWlrVariance][i];
        variance = std::max(Bounded(variance, kLargestVariance), 0.0f);
        input.plane[kWlrDeviation][i] = std::sqrt(variance);
        input.plane[kWlrTrust][i] = 1 / std::max(variance, 1.0f);
    }
    return input;
}

void ForEachWlrPixel(const WlrInput& input, int radius, const WlrKernels& kernels,
                     const CancelToken& cancel,
                     const std::function<void(std::size_t, const WlrCurves&)>& use) {
    ForEachWlrTile(input, radius, cancel, [&](const WlrTile& tile, const TileArea& area) {
        std::vector<float> out((kWlrTrials * kWlrFitPlanes + 1) * kTileArea);
        kernels.try_bandwidths(tile, out.data());
        for (int y = 0; y < area.height; ++y) {
            for (int x = 0; x < area.width; ++x) {
                const std::size_t i = static_cast<std::size_t>(area.y0 + y) * input.width +
                                      static_cast<std::size_t>(area.x0 + x);
                const float* at = out.data() + y * kTileWidth + x;
                WlrTrials trials;
                for (int t = 0; t < kWlrTrials; ++t, at += kWlrFitPlanes * kTileArea) {
                    trials.change[t] = 0;
                    for (int c = 0; c < 3; ++c) {
                        trials.change[t] +=
                            (at[(kWlrValue + c) * kTileArea] - input.plane[kWlrColor + c][i]) / 3.0;
                    }
                    trials.variance[t] = at[kWlrFitVariance * kTileArea];
                }
                trials.dimensions = static_cast<int>(*at);
                trials.count = input.count.empty() ? 1 : std::max(input.count[i], 1.0f);
                use(i, FitCurves(trials));
            }
        }
    });
}

std::array<Plane, kWlrFitPlanes> FitWlr(const WlrInput& input, int radius, const Plane& bandwidth,
                                        const WlrKernels& kernels, const CancelToken& cancel) {
    std::array<Plane, kWlrFitPlanes> result;
    for (Plane& plane : result) {
        plane.resize(bandwidth.size());
    }
    ForEachWlrTile(input, radius, cancel, [&](const WlrTile& tile, const TileArea& area) {
        std::vector<float> own(kTileArea, 1.0f), out(kWlrFitPlanes * kTileArea);
        const auto row = [&](int y) {
            return static_cast<std::ptrdiff_t>(area.y0 + y) * input.width + area.x0;
        };
        for (int y = 0; y < area.height; ++y) {
            std::copy_n(bandwidth.begin() + row(y), area.width, own.begin() + y * kTileWidth);
        }
        kernels.fit(tile, own.data(), out.data());
        for (std::size_t p = 0; p < kWlrFitPlanes; ++p) {
            for (int y = 0; y < area.height; ++y) {
                std::copy_n(
                    out.begin() + static_cast<std::ptrdiff_t>(p) * kTileArea + y * kTileWidth,
                    area.width, result[p].begin() + row(y));
            }
        }
    });
    return result;
}

}  // namespace relume::denoise
