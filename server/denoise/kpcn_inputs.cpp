#include "server/denoise/kpcn_inputs.h"

#include <algorithm>
#include <cmath>

namespace relume::denoise {
namespace {

constexpr float kLeastAlbedo = 0.00316f;
constexpr float kNoSurface = 0.01f;  // all channels below: the light of what is seen, not reflected

void AddGroup(const std::vector<Plane>& means, Plane variance, int width,
              std::vector<Plane>* planes) {
    planes->insert(planes->end(), means.begin(), means.end());
    planes->push_back(std::move(variance));
    const auto w = static_cast<std::size_t>(width);
    for (const bool along_x : {true, false}) {
        for (const Plane& mean : means) {
            Plane& difference = planes->emplace_back(mean.size());
            for (std::size_t i = 0; i < mean.size(); ++i) {
                const bool first = along_x ? i % w == 0 : i < w;
                difference[i] = first ? 0 : mean[i] - mean[i - (along_x ? 1 : w)];
            }
        }
    }
}

// Means and mean variance of a feature's channels, times `scale`, cut to [low, high].
void AddFeature(const Frame& frame, int first, int count, float scale, float low, float high,
                std::vector<Plane>* planes) {
    std::vector<Plane> means;
    Plane variance(frame.pixel_count());
    for (int f = first; f < first + count; ++f) {
        Plane& mean = means.emplace_back(frame.pixel_count());
        const Plane &from = frame.feature[f], &of_sample = frame.feature_variance[f];
        for (std::size_t i = 0; i < from.size(); ++i) {
            mean[i] = std::clamp(from[i] * scale, low, high);
        }
        for (std::size_t i = 0; i < of_sample.size(); ++i) {
            const float n = frame.count.empty() ? 1 : std::max(frame.count[i], 1.0f);
            variance[i] += of_sample[i] / n * scale * scale / static_cast<float>(count);
        }
    }
    AddGroup(means, std::move(variance), frame.width, planes);
}

}  // namespace

KpcnInputs MakeKpcnInputs(const Frame& frame) {
    KpcnInputs inputs;
    const std::size_t pixels = frame.pixel_count();
    const bool has_albedo = !frame.feature[kAlbedoR].empty() && !frame.feature[kAlbedoG].empty() &&
                            !frame.feature[kAlbedoB].empty();
    std::vector<Plane> logs(3, Plane(pixels));
    Plane variance(pixels);
    for (std::size_t c = 0; c < 3; ++c) {
        inputs.albedo[c].assign(pixels, 1.0f);
        inputs.color[c].resize(pixels);
    }
    for (std::size_t i = 0; i < pixels; ++i) {
        float albedo[3] = {};
        for (int c = 0; c < 3 && has_albedo; ++c) {
            albedo[c] = std::max(frame.feature[kAlbedoR + c][i], 0.0f);
        }
        const bool surface = std::max({albedo[0], albedo[1], albedo[2]}) >= kNoSurface;
        for (std::size_t c = 0; c < 3; ++c) {
            if (surface) {
                inputs.albedo[c][i] = albedo[c] + kLeastAlbedo;
            }
            const float color = frame.color[c][i] / inputs.albedo[c][i];
            inputs.color[c][i] = color;
            const float above = 1 + std::max(color, 0.0f);
            logs[c][i] = std::log(above);
            const float scale = 1 / (inputs.albedo[c][i] * above);
            variance[i] += frame.variance[c][i] * scale * scale * (1.0f / 3.0f);
        }
    }
    AddGroup(logs, std::move(variance), frame.width, &inputs.planes);
    AddFeature(frame, kNormalX, 3, 1, -1, 1, &inputs.planes);
    float farthest = 0;
    for (const float depth : frame.feature[kDepth]) {
        farthest = std::max(farthest, depth);
    }
    AddFeature(frame, kDepth, 1, farthest > 0 ? 1 / farthest : 0, 0, 1, &inputs.planes);
    AddFeature(frame, kAlbedoR, 3, 1, 0, 1, &inputs.planes);
    return inputs;
}

}  // namespace relume::denoise
