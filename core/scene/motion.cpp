#include "core/scene/motion.h"

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

// Changes below this share of the numbers themselves are rounding.
constexpr float kStill = 1e-6f;

struct Tolerances {
    float axes, origin;
};

float AxesLength(const std::array<float, 12>& m) {
    float sum = 0;
    for (const std::size_t i : {0, 1, 2, 4, 5, 6, 8, 9, 10}) {
        sum += m[i] * m[i];
    }
    return std::sqrt(sum);
}

float OriginLength(const std::array<float, 12>& m) {
    return std::sqrt(m[3] * m[3] + m[7] * m[7] + m[11] * m[11]);
}

// The difference of `at` from the mean of a and b with these weights.
std::array<float, 12> Difference(const Transform& at, const Transform& a, const Transform& b,
                                 float weight) {
    std::array<float, 12> d{};
    for (std::size_t i = 0; i < d.size(); ++i) {
        d[i] = at.rows()[i] - ((1 - weight) * a.rows()[i] + weight * b.rows()[i]);
    }
    return d;
}

bool Within(const std::array<float, 12>& difference, const Tolerances& tolerances) {
    return AxesLength(difference) <= tolerances.axes &&
           OriginLength(difference) <= tolerances.origin;
}

// `fits(sample, key before, key after, weight of the latter)`, for samples between keys.
template <class Fits>
std::size_t FewestKeys(const Fits& fits) {
    for (std::size_t keys = 2; keys < kMostKeys; keys = 2 * keys - 1) {
        const std::size_t stride = (kMotionSamples - 1) / (keys - 1);
        bool good = true;
        for (std::size_t i = 0; i < kMotionSamples && good; ++i) {
            const std::size_t before = i / stride * stride;
            good = i == before || fits(i, before, before + stride,
                                       static_cast<float>(i - before) / static_cast<float>(stride));
        }
        if (good) {
            return keys;
        }
    }
    return kMostKeys;
}

}  // namespace

std::size_t KeysNeeded(const SampledTransform& samples) {
    if (samples.size() < 2) {
        return 1;
    }
    float axes = 0, origin = 0, way = 0;
    for (const Transform& sample : samples) {
        axes = std::max(axes, AxesLength(sample.rows()));
        origin = std::max(origin, OriginLength(sample.rows()));
        way = std::max(way, OriginLength(Difference(sample, samples[0], samples[0], 0)));
    }
    const Tolerances rounding{kStill * axes, kStill * origin};
    if (std::all_of(samples.begin(), samples.end(), [&](const Transform& sample) {
            return Within(Difference(sample, samples[0], samples[0], 0), rounding);
        })) {
        return 1;
    }
    const Tolerances allowed{kMotionError * axes, std::max(kMotionError * way, rounding.origin)};
    return FewestKeys([&](std::size_t i, std::size_t a, std::size_t b, float weight) {
        return Within(Difference(samples[i], samples[a], samples[b], weight), allowed);
    });
}

std::size_t KeysNeeded(const SampledWeights& samples) {
    if (std::all_of(samples.begin(), samples.end(),
                    [&](const auto& sample) { return sample == samples[0]; })) {
        return 1;
    }
    return FewestKeys([&](std::size_t i, std::size_t a, std::size_t b, float weight) {
        for (std::size_t k = 0; k < samples[i].size(); ++k) {
            const float linear = (1 - weight) * samples[a][k] + weight * samples[b][k];
            if (!(std::abs(samples[i][k] - linear) <= kMotionError)) {
                return false;
            }
        }
        return true;
    });
}

std::vector<Transform> MotionKeys(const SampledTransform& samples) {
    const std::size_t keys = KeysNeeded(samples);
    std::vector<Transform> motion;
    for (std::size_t k = 0; keys > 1 && k < keys; ++k) {
        motion.push_back(samples[SampleOfKey(k, keys)]);
    }
    return motion;
}

SampledTransform Multiply(const SampledTransform& left, const SampledTransform& right) {
    SampledTransform product(std::max(left.size(), right.size()));
    for (std::size_t i = 0; i < product.size(); ++i) {
        product[i] = left[std::min(i, left.size() - 1)] * right[std::min(i, right.size() - 1)];
    }
    return product;
}

std::vector<double> SampleTimes(double open, double seconds) {
    if (!(seconds > 0)) {
        return {open};
    }
    std::vector<double> times(kMotionSamples);
    for (std::size_t i = 0; i < times.size(); ++i) {
        times[i] = open + seconds * static_cast<double>(i) / (kMotionSamples - 1);
    }
    return times;
}

}  // namespace relume
