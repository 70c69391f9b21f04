#include "server/jobs/guide_rule.h"

#include <cmath>

#include "server/jobs/box_mean.h"

namespace relume::jobs {
namespace {

constexpr double kNoiseShare = 0.3;

double Sum(const std::vector<float>& values) {
    double sum = 0;
    for (const float v : values) {
        sum += v;
    }
    return sum;
}

}  // namespace

std::vector<float> GuidedDeviation(const Film& film, const std::vector<float>& disagreement,
                                   const std::vector<float>& noise) {
    std::vector<float> counts(film.pixel_count());
    for (std::size_t i = 0; i < counts.size(); ++i) {
        counts[i] = film.SampleCount(i);
    }
    const std::vector<float> differ = BoxMean(disagreement, film.width(), film.height());
    const std::vector<float> samples = BoxMean(counts, film.width(), film.height());
    std::vector<float> guided(film.pixel_count());
    // A quarter of the squared difference of two halves is the variance of their mean.
    for (std::size_t i = 0; i < guided.size(); ++i) {
        guided[i] = std::sqrt(0.25f * differ[i] * samples[i]);
    }
    const double guided_sum = Sum(guided), noise_sum = Sum(noise);
    if (!(guided_sum > 0) || !(noise_sum > 0)) {
        return noise;
    }
    const double from_guide = 1 - kNoiseShare, from_noise = kNoiseShare * guided_sum / noise_sum;
    for (std::size_t i = 0; i < guided.size(); ++i) {
        guided[i] = static_cast<float>(from_guide * guided[i] + from_noise * noise[i]);
    }
    return guided;
}

}  // namespace relume::jobs
