#include "server/denoise/rd_features.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace relume::denoise {
namespace {

// Features beyond this are bounded, so that products of denominators are numbers.
constexpr float kLargest = 100;

// Squared slope over half a pixel: of each of x and y the lesser one of the two sides, so that a
// step is none. 0 at the border.
Plane SquaredGradient(const Plane& f, int width, int height) {
    Plane out(f.size());
    const auto half_step = [](float a, float b) { return 0.25f * (a - b) * (a - b); };
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                           static_cast<std::size_t>(x);
            const auto row = static_cast<std::size_t>(width);
            if (x > 0 && x + 1 < width) {
                out[i] += std::min(half_step(f[i], f[i - 1]), half_step(f[i], f[i + 1]));
            }
            if (y > 0 && y + 1 < height) {
                out[i] += std::min(half_step(f[i], f[i - row]), half_step(f[i], f[i + row]));
            }
        }
    }
    return out;
}

}  // namespace

RdFeaturePlanes MakeRdFeatures(const Frame& frame, PrefilteredFeatures features) {
    RdFeaturePlanes out;
    const auto add = [&](int first, int count, float scale, float offset, const char* name) {
        if (features.feature[first].empty()) {
            return;
        }
        out.group_size.push_back(count);
        out.names += (out.names.empty() ? "" : ", ") + std::string(name);
        for (int f = first; f < first + count; ++f) {
            Plane& value = features.feature[f];
            Plane& variance = features.variance[f];
            for (float& x : value) {
                x = std::clamp(x * scale + offset, -kLargest, kLargest);
            }
            for (float& x : variance) {
                x = std::min(x * scale * scale, kLargest);
            }
            Plane spread = SquaredGradient(value, frame.width, frame.height);
            for (std::size_t i = 0; i < spread.size(); ++i) {
                spread[i] = std::max(spread[i], variance[i]);
            }
            out.value.push_back(std::move(value));
            out.variance.push_back(std::move(variance));
            out.spread.push_back(std::move(spread));
        }
    };
    const auto largest = [&](int first, int count) {
        float result = 0;
        for (int f = first; f < first + count; ++f) {
            for (const float x : features.feature[f]) {
                result = std::max(result, x);
            }
        }
        return result;
    };
    add(kNormalX, 3, 0.5f, 0.5f, "normal");
    add(kAlbedoR, 3, 1 / std::max(largest(kAlbedoR, 3), 1.0f), 0, "albedo");
    const float depth = largest(kDepth, 1);
    add(kDepth, 1, depth > 0 ? 1 / depth : 0, 0, "depth");
    add(kVisibility, 1, 1, 0, "visibility");
    return out;
}

}  // namespace relume::denoise
