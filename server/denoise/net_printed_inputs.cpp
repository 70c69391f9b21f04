#include "server/denoise/net_printed_inputs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/denoise/bilateral.h"
#include "server/denoise/each_pixel.h"

namespace relume::denoise {
namespace {

constexpr float kMostLog = 16, kMostNoise = 4, kMostCount = 2;

}  // namespace

std::vector<std::string> PrintedNetInputNames() {
    return {"color.R",      "color.G",     "color.B",  "color.noise", "N.X",   "N.Y",
            "N.Z",          "albedo.R",    "albedo.G", "albedo.B",    "depth", "normal.noise",
            "albedo.noise", "depth.noise", "gradient", "count"};
}

std::vector<Plane> MakePrintedNetInputs(const Frame& frame, const Guides& guides) {
    const std::size_t size = frame.pixel_count();
    const auto log = [](float x) { return AtMost(kMostLog, std::log1p(std::max(x, 0.0f))); };
    std::vector<Plane> inputs;
    for (const Plane& color : frame.color) {
        inputs.push_back(FillPlane(size, [&](std::size_t i) { return log(color[i]); }));
    }
    inputs.push_back(FillPlane(size, [&](std::size_t i) {
        float radiance = 0, variance = 0;
        for (int c = 0; c < 3; ++c) {
            radiance += std::max(frame.color[c][i], 0.0f) / 3;
            variance += std::max(frame.variance[c][i], 0.0f) / 3;
        }
        return AtMost(kMostNoise, std::sqrt(variance) / (1 + radiance));
    }));
    for (int f = 0; f < 7; ++f) {
        const float least = f < 6 ? -1.0f : 0.0f;
        inputs.push_back(FillPlane(
            size, [&](std::size_t i) { return std::clamp(guides.feature[f][i], least, 1.0f); }));
    }
    constexpr float kChannels[3] = {3, 3, 1};
    for (int g = 0; g < 3; ++g) {
        inputs.push_back(FillPlane(size, [&](std::size_t i) {
            const float n = frame.count.empty() ? 1.0f : std::max(frame.count[i], 1.0f);
            return AtMost(kMostNoise, std::sqrt(guides.variance[g][i] / (n * kChannels[g])));
        }));
    }
    const Plane gradient = SobelMagnitude(frame);
    inputs.push_back(FillPlane(size, [&](std::size_t i) { return log(gradient[i]); }));
    inputs.push_back(frame.count.empty() ? Plane(size, 0.0f) : FillPlane(size, [&](std::size_t i) {
        return std::min(std::log2(1 + frame.count[i]) / 8, kMostCount);
    }));
    return inputs;
}

}  // namespace relume::denoise
