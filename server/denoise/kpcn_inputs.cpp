#include "server/denoise/kpcn_inputs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/denoise/each_pixel.h"

namespace relume::denoise {
namespace {

constexpr float kAlbedoFloor = 0.03f;
constexpr float kMostLog = 16, kMostNoise = 4;

void Demodulate(const Frame& frame, KpcnInputs* inputs) {
    for (std::size_t c = 0; c < 3; ++c) {
        inputs->divisor[c].assign(frame.pixel_count(), 1.0f);
        inputs->demodulated[c].resize(frame.pixel_count());
    }
    ForEachPixel(frame.pixel_count(), [&](std::size_t i) {
        float squared = 0;
        for (int c = 0; c < 3; ++c) {
            const float n = frame.feature[kNormalX].empty() ? 0.0f : frame.feature[kNormalX + c][i];
            squared += n * n;
        }
        // No step where surfaces end or become black: what is divided by little must not meet what
        // is divided by 1.
        const float open = frame.feature[kNormalX].empty() ? 0.0f : 1 - std::sqrt(squared);
        for (std::size_t c = 0; c < 3 && !frame.feature[kAlbedoR].empty(); ++c) {
            inputs->divisor[c][i] = std::clamp(frame.feature[kAlbedoR + c][i], 0.0f, 1.0f) +
                                    std::max(open, 0.0f) + kAlbedoFloor;
        }
        for (std::size_t c = 0; c < 3; ++c) {
            inputs->demodulated[c][i] = frame.color[c][i] / inputs->divisor[c][i];
        }
    });
}

// Adds `mean`, `noise` and the steps of `mean` to the channels.
void AddWithSteps(const Frame& frame, std::vector<Plane> mean, Plane noise,
                  std::vector<Plane>* channels) {
    const auto width = static_cast<std::size_t>(frame.width);
    std::vector<Plane> across, down;
    for (const Plane& plane : mean) {
        across.emplace_back(plane.size());
        down.emplace_back(plane.size());
        ForEachPixel(plane.size(), [&](std::size_t i) {
            across.back()[i] = i % width > 0 ? plane[i] - plane[i - 1] : 0.0f;
            down.back()[i] = i >= width ? plane[i] - plane[i - width] : 0.0f;
        });
    }
    std::ranges::move(mean, std::back_inserter(*channels));
    channels->push_back(std::move(noise));
    std::ranges::move(across, std::back_inserter(*channels));
    std::ranges::move(down, std::back_inserter(*channels));
}

void AddColor(const Frame& frame, KpcnInputs* inputs) {
    std::vector<Plane> mean(3, Plane(frame.pixel_count()));
    Plane noise(frame.pixel_count());
    ForEachPixel(frame.pixel_count(), [&](std::size_t i) {
        float divisor = 0, radiance = 0, variance = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const float lit = std::max(inputs->demodulated[c][i], 0.0f);
            mean[c][i] = AtMost(kMostLog, std::log1p(lit));
            divisor += inputs->divisor[c][i] / 3;
            radiance += lit / 3;
            variance += frame.variance[c][i] / 3;
        }
        noise[i] =
            AtMost(kMostNoise, std::sqrt(std::max(variance, 0.0f)) / (divisor * (1 + radiance)));
    });
    AddWithSteps(frame, std::move(mean), std::move(noise), &inputs->channels);
}

// Features `first` to `first` + count - 1 times `scale`, within [least, 1].
void AddFeature(const Frame& frame, int first, int count, float scale, float least,
                KpcnInputs* inputs) {
    std::vector<Plane> mean(static_cast<std::size_t>(count), Plane(frame.pixel_count(), 0.0f));
    Plane noise(frame.pixel_count(), 0.0f);
    ForEachPixel(frame.pixel_count(), [&](std::size_t i) {
        const float n = frame.count.empty() ? 1.0f : std::max(frame.count[i], 1.0f);
        float variance = 0;
        for (int f = first; f < first + count; ++f) {
            if (!frame.feature[f].empty()) {
                mean[static_cast<std::size_t>(f - first)][i] =
                    std::clamp(frame.feature[f][i] * scale, least, 1.0f);
            }
            if (!frame.feature_variance[f].empty()) {
                variance += std::max(frame.feature_variance[f][i], 0.0f);
            }
        }
        noise[i] =
            AtMost(kMostNoise, scale * std::sqrt(variance / (n * static_cast<float>(count))));
    });
    AddWithSteps(frame, std::move(mean), std::move(noise), &inputs->channels);
}

}  // namespace

std::vector<std::string> KpcnInputNames() {
    std::vector<std::string> names;
    const auto add = [&](const std::string& name, const std::vector<std::string>& channels) {
        for (const std::string& c : channels) {
            names.push_back(name + c);
        }
        names.push_back(name + ".noise");
        for (const char* step : {".dx", ".dy"}) {
            for (const std::string& c : channels) {
                names.push_back(name + c + step);
            }
        }
    };
    add("color", {".R", ".G", ".B"});
    add("N", {".X", ".Y", ".Z"});
    add("depth", {""});
    add("albedo", {".R", ".G", ".B"});
    return names;
}

float KpcnDepthScale(const Frame& frame) {
    float largest = 0;
    for (const float z : frame.feature[kDepth]) {
        largest = std::max(largest, z);
    }
    return largest > 0 ? 1 / largest : 0;
}

KpcnInputs MakeKpcnInputs(const Frame& frame, float depth_scale) {
    KpcnInputs inputs;
    Demodulate(frame, &inputs);
    AddColor(frame, &inputs);
    AddFeature(frame, kNormalX, 3, 1, -1, &inputs);
    AddFeature(frame, kDepth, 1, depth_scale, 0, &inputs);
    AddFeature(frame, kAlbedoR, 3, 1, -1, &inputs);
    return inputs;
}

}  // namespace relume::denoise
