#include "server/denoise/feature_prefilter.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/denoise/feature_groups.h"
#include "server/denoise/frame_repair.h"
#include "server/denoise/halves.h"
#include "server/denoise/nlm_filter.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

constexpr int kRadius = 5;
constexpr float kLeastResidual = 1e-6f;  // below it is 0, for features of about 1

// Where both halves have samples, and how much of the squared difference of their means is variance
// of the mean: nA nB / n^2.
struct HalvesShare {
    Plane known, share;
};

HalvesShare ShareOfHalves(const Frame& frame) {
    HalvesShare out;
    out.known.assign(frame.pixel_count(), 1.0f);
    out.share.assign(frame.pixel_count(), 0.25f);
    for (std::size_t i = 0; i < frame.count.size(); ++i) {
        const float n = frame.count[i], a = HalfCount(n, 0), b = HalfCount(n, 1);
        out.known[i] = a > 0 && b > 0 ? 1.0f : 0.0f;
        out.share[i] = n > 0 ? a * b / (n * n) : 0.0f;
    }
    return out;
}

// What one channel is filtered with: variance of its mean, and a plane whose square has that for
// its mean; empty without halves.
struct Noise {
    Plane variance, deviation;
};

Noise NoiseOf(const Frame& frame, int f, const HalvesShare& halves) {
    const std::size_t pixels = frame.pixel_count();
    Noise noise;
    noise.variance = frame.feature_variance[f];
    if (noise.variance.empty()) {
        return noise;
    }
    for (std::size_t i = 0; i < frame.count.size(); ++i) {
        noise.variance[i] /= std::max(frame.count[i], 1.0f);
    }
    if (frame.feature_half[0][f].empty()) {
        return noise;
    }
    noise.deviation.resize(pixels);
    Plane squared(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        const float d = frame.feature_half[0][f][i] - frame.feature_half[1][f][i];
        noise.deviation[i] = d * std::sqrt(halves.share[i]);
        squared[i] = d * d * halves.share[i];
    }
    noise.variance = Regularise(frame.width, frame.height, noise.variance, squared, halves.known);
    return noise;
}

bool IsNoisy(const Noise& noise) {
    return std::ranges::any_of(noise.variance, [](float v) { return v > 0; });
}

void FilterGroup(const Frame& frame, const FeatureGroup& group, const HalvesShare& halves,
                 const CancelToken& cancel, const NlmKernels& kernels, PrefilteredFeatures* out) {
    std::vector<Noise> noise;
    bool noisy = false;
    for (int f = group.first; f < group.first + group.count; ++f) {
        noise.push_back(NoiseOf(frame, f, halves));
        noisy = noisy || IsNoisy(noise.back());
    }
    if (!noisy) {
        for (int f = group.first; f < group.first + group.count; ++f) {
            out->feature[f] = frame.feature[f];
            out->variance[f].assign(frame.pixel_count(), 0.0f);
        }
        return;
    }
    float largest = 0;  // 1 but for depth
    for (const float value : frame.feature[group.first]) {
        largest = std::max(largest, std::abs(value));
    }
    const float unit = group.count == 1 ? std::max(largest * largest, 1e-30f) : 1.0f;
    NlmGuide guide;
    guide.width = frame.width;
    guide.height = frame.height;
    std::vector<const Plane*> in;
    std::vector<Plane*> to;
    std::vector<Plane> deviation(static_cast<std::size_t>(group.count));
    for (int k = 0; k < group.count; ++k) {
        const auto at = static_cast<std::size_t>(k);
        noise[at].variance.resize(frame.pixel_count());
        guide.value.push_back(&frame.feature[group.first + k]);
        guide.variance.push_back(&noise[at].variance);
        in.push_back(&frame.feature[group.first + k]);
        to.push_back(&out->feature[group.first + k]);
        if (!noise[at].deviation.empty()) {
            in.push_back(&noise[at].deviation);
            to.push_back(&deviation[at]);
        }
    }
    Plane share;
    FilterNlm(guide, {.k = 1, .epsilon = 1e-10f * unit}, kRadius, in, to, cancel, kernels, &share);
    for (int k = 0; k < group.count; ++k) {
        const auto at = static_cast<std::size_t>(k);
        Plane left(frame.pixel_count());
        for (std::size_t i = 0; i < left.size(); ++i) {
            left[i] = deviation[at].empty() ? noise[at].variance[i] * share[i]
                                            : deviation[at][i] * deviation[at][i];
        }
        left = SmoothResidual(left, frame.width, frame.height);
        for (float& v : left) {
            v = v < kLeastResidual * unit ? 0.0f : v;
        }
        out->variance[group.first + k] = std::move(left);
    }
}

}  // namespace

Plane SmoothResidual(const Plane& variance, int width, int height) {
    return BlurByTaps(variance, width, height, {0.1353f, 1, 0.1353f});
}

PrefilteredFeatures PrefilterFeatures(const Frame& frame, const CancelToken& cancel,
                                      const NlmKernels& kernels) {
    const HalvesShare halves = ShareOfHalves(frame);
    PrefilteredFeatures out;
    for (const FeatureGroup& group : kFeatureGroups) {
        if (!frame.feature[group.first].empty()) {
            FilterGroup(frame, group, halves, cancel, kernels, &out);
        }
    }
    return out;
}

}  // namespace relume::denoise
