#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/film/aov.h"
#include "core/math/vec.h"

namespace relume {

// One sample of a pixel, as a path tracer makes it.
struct PixelSample {
    Rgb radiance;
    float indirect_luminance = 0;  // luminance without directly seen emission
    std::array<float, kFeatureCount> features{};
};

// Count, mean and sum of squared deviations of one number (Welford; merge by Chan et al. 1979).
struct Moments {
    double n = 0;
    double mean = 0;
    double m2 = 0;

    void Add(double x);
    void Merge(const Moments& other);
    // Unbiased variance of one sample, m2/(n-1); 0 below two samples.
    double SampleVariance() const { return n > 1 ? m2 / (n - 1) : 0; }
    // Variance of the mean, m2/(n(n-1)); 0 below two samples.
    double MeanVariance() const { return n > 1 ? m2 / (n * (n - 1)) : 0; }
};

// Everything that the film keeps of one pixel, in double while it is added up; stored and sent as
// kFilmChannelCount floats.
class PixelMoments {
  public:
    // `index` is the global sample index: its parity is the half. A sample with a NaN or an
    // infinity is counted as bad and leaves no other trace: false.
    bool Add(std::uint32_t index, const PixelSample& sample);
    // Writes channel c at data[c * stride].
    void Store(float* data, std::size_t stride) const;

  private:
    std::array<std::array<Moments, 3>, 2> color_{};
    std::array<std::array<double, kFeatureCount>, 2> feature_mean_{};  // by half
    std::array<Moments, kFeatureCount> feature_{};                     // both halves
    double bad_ = 0;
    float max_luminance_ = 0;
};

}  // namespace relume
