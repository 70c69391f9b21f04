#include "core/film/moments.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume {

void Moments::Add(double x) {
    n += 1;
    const double delta = x - mean;
    mean += delta / n;
    m2 += delta * (x - mean);
}

void Moments::Merge(const Moments& other) {
    if (other.n == 0) {
        return;
    }
    const double total = n + other.n;
    const double delta = other.mean - mean;
    mean += delta * other.n / total;
    m2 += other.m2 + delta * delta * n * other.n / total;
    n = total;
}

bool PixelMoments::Add(std::uint32_t index, const PixelSample& sample) {
    bool finite = IsFinite(sample.radiance) && std::isfinite(sample.indirect_luminance);
    for (const float f : sample.features) {
        finite = finite && std::isfinite(f);
    }
    if (!finite) {
        bad_ += 1;
        return false;
    }
    const std::size_t half = index & 1;
    for (int c = 0; c < 3; ++c) {
        color_[half][static_cast<std::size_t>(c)].Add(sample.radiance[c]);
    }
    const double n = color_[half][0].n;
    for (std::size_t f = 0; f < kFeatureCount; ++f) {
        feature_mean_[half][f] += (sample.features[f] - feature_mean_[half][f]) / n;
        feature_[f].Add(sample.features[f]);
    }
    max_luminance_ = std::max(max_luminance_, sample.indirect_luminance);
    return true;
}

void PixelMoments::Store(float* data, std::size_t stride) const {
    const auto put = [&](std::size_t channel, double value) {
        data[channel * stride] = static_cast<float>(value);
    };
    // The square of a finite radiance may be larger than any float.
    const auto put_m2 = [&](std::size_t channel, double value) {
        put(channel, std::min<double>(value, std::numeric_limits<float>::max()));
    };
    put(kCountA, color_[0][0].n);
    put(kCountB, color_[1][0].n);
    put(kBadCount, bad_);
    put(kMaxLuminance, max_luminance_);
    for (std::size_t c = 0; c < 3; ++c) {
        put(kMeanA + c, color_[0][c].mean);
        put(kMeanB + c, color_[1][c].mean);
        put_m2(kM2A + c, color_[0][c].m2);
        put_m2(kM2B + c, color_[1][c].m2);
    }
    for (std::size_t f = 0; f < kFeatureCount; ++f) {
        put(kFeatureMeanA + f, feature_mean_[0][f]);
        put(kFeatureMeanB + f, feature_mean_[1][f]);
        put_m2(kFeatureM2 + f, feature_[f].m2);
    }
}

}  // namespace relume
