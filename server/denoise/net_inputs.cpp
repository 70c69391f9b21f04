#include "server/denoise/net_inputs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/denoise/each_pixel.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

constexpr float kDark = 0.03f;  // radiance; from here down logarithms become linear
constexpr float kLogScale = 1.0f / 8, kMostLog = 2.0f;
constexpr float kMostRoot = 2.0f;  // of what is relative, after its square root
constexpr int kWindow = 2;         // radius, of residuals
constexpr float kLeastVariance = 1e-6f;

float Log(float radiance) {
    return std::min(std::log2(1 + std::max(radiance, 0.0f) / kDark) * kLogScale, kMostLog);
}

// The fourth root of what is squared: dense where errors are small.
float Root(float squared) {
    return std::min(std::sqrt(std::sqrt(std::max(squared, 0.0f))), kMostRoot);
}

float Luminance(float r, float g, float b) { return 0.2126f * r + 0.7152f * g + 0.0722f * b; }

// Noise of features `first` to `first` + 2 of the pixel's mean: root of the mean variance.
Plane FeatureNoise(const Frame& frame, int first) {
    if (frame.feature_variance[first].empty()) {
        return Plane(frame.pixel_count(), 0.0f);
    }
    return FillPlane(frame.pixel_count(), [&](std::size_t i) {
        float variance = 0;
        for (int f = first; f < first + 3; ++f) {
            variance += frame.feature_variance[f][i];
        }
        const float count = frame.count.empty() ? 1.0f : std::max(frame.count[i], 1.0f);
        return Root(variance / (3 * count));
    });
}

// Relative steps of the depth to the neighbours at the right and below.
Plane DepthSteps(const Frame& frame) {
    const Plane& depth = frame.feature[kDepth];
    if (depth.empty()) {
        return Plane(frame.pixel_count(), 0.0f);
    }
    const auto width = static_cast<std::size_t>(frame.width);
    return FillPlane(frame.pixel_count(), [&](std::size_t i) {
        const float here = depth[i];
        const float right = i % width + 1 < width ? depth[i + 1] : here;
        const float below = i + width < depth.size() ? depth[i + width] : here;
        const float step = std::abs(right - here) + std::abs(below - here);
        return std::min(std::sqrt(step / std::max(here, 1e-6f)), kMostRoot);
    });
}

// Squared distance to the noisy image over the noise's variance, each summed over a window.
Plane Residual(const Frame& frame, const Result& result, const Plane& noise) {
    const Plane squared = FillPlane(frame.pixel_count(), [&](std::size_t i) {
        float sum = 0;
        for (int c = 0; c < 3; ++c) {
            const float difference = result.color[c][i] - frame.color[c][i];
            sum += difference * difference;
        }
        return sum;
    });
    const Plane distance = SumBox(squared, frame.width, frame.height, kWindow);
    return FillPlane(frame.pixel_count(), [&](std::size_t i) {
        return Root(distance[i] / (noise[i] + kLeastVariance));
    });
}

}  // namespace

std::vector<std::string> NetInputNames() {
    std::vector<std::string> names = {"noise", "count"};
    for (int f = 0; f < kVisibility; ++f) {
        names.emplace_back(f == kDepth ? "depth_step" : FeatureName(f));
    }
    names.insert(names.end(), {"albedo_noise", "normal_noise"});
    for (const auto& slot : kNetSlots) {
        const std::string name = slot.name;
        for (const char* channel : {".R", ".G", ".B"}) {
            names.push_back(name + channel);
        }
        if (name != "none") {
            names.push_back(name + ".residual");
            names.push_back(name + ".error");
        }
    }
    return names;
}

std::vector<Plane> MakeNetInputs(const Frame& frame, const NetCandidates& candidates) {
    const std::size_t size = frame.pixel_count();
    const auto zeros = [&] { return Plane(size, 0.0f); };
    const Result& base = *candidates[kBilateralSlot];
    const Plane brightness = FillPlane(size, [&](std::size_t i) {
        const float y = Luminance(base.color[0][i], base.color[1][i], base.color[2][i]);
        return y * y + 0.01f;
    });
    std::vector<Plane> inputs;
    const Plane noise = FillPlane(size, [&](std::size_t i) {
        return frame.variance[0][i] + frame.variance[1][i] + frame.variance[2][i];
    });
    inputs.push_back(
        FillPlane(size, [&](std::size_t i) { return Root(noise[i] / (3 * brightness[i])); }));
    inputs.push_back(frame.count.empty() ? zeros() : FillPlane(size, [&](std::size_t i) {
        return std::min(std::log2(1 + frame.count[i]) * kLogScale, kMostLog);
    }));
    for (int f = 0; f < kDepth; ++f) {
        inputs.push_back(frame.feature[f].empty() ? zeros() : FillPlane(size, [&](std::size_t i) {
            return std::clamp(frame.feature[f][i], -1.0f, 1.0f);
        }));
    }
    inputs.push_back(DepthSteps(frame));
    inputs.push_back(FeatureNoise(frame, kAlbedoR));
    inputs.push_back(FeatureNoise(frame, kNormalX));
    const Plane summed_noise = SumBox(noise, frame.width, frame.height, kWindow);
    for (std::size_t k = 0; k < kNetSlotCount; ++k) {
        const Result* candidate = candidates[k];
        for (const int c : {0, 1, 2}) {
            inputs.push_back(candidate == nullptr ? zeros() : FillPlane(size, [&](std::size_t i) {
                return Log(candidate->color[c][i]);
            }));
        }
        if (k > 0) {
            inputs.push_back(candidate == nullptr ? zeros()
                                                  : Residual(frame, *candidate, summed_noise));
            inputs.push_back(candidate == nullptr || !candidate->error
                                 ? zeros()
                                 : FillPlane(size, [&](std::size_t i) {
                                       return Root((*candidate->error)[i] / brightness[i]);
                                   }));
        }
    }
    return inputs;
}

}  // namespace relume::denoise
