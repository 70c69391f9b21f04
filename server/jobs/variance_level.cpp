#include "server/jobs/variance_level.h"

#include "core/base/parallel.h"
#include "server/jobs/box_mean.h"

namespace relume::jobs {
namespace {

constexpr std::size_t kGrain = 4096;  // pixels a task

}  // namespace

std::array<std::vector<float>, 3> VarianceLevel(const Film& film) {
    std::array<std::vector<float>, 3> sample, half;
    for (std::size_t c = 0; c < 3; ++c) {
        sample[c].resize(film.pixel_count());
        half[c].resize(film.pixel_count());
    }
    ParallelFor(0, film.pixel_count(), kGrain, [&](std::size_t i0, std::size_t i1) {
        for (std::size_t i = i0; i < i1; ++i) {
            const Rgb s = film.MeanVariance(i), d = film.HalfVariance(i);
            for (std::size_t c = 0; c < 3; ++c) {
                sample[c][i] = s[static_cast<int>(c)];
                half[c][i] = d[static_cast<int>(c)];
            }
        }
    });
    for (std::size_t c = 0; c < 3; ++c) {
        sample[c] = BoxMean(sample[c], film.width(), film.height());
        half[c] = BoxMean(half[c], film.width(), film.height());
        for (std::size_t i = 0; i < half[c].size(); ++i) {
            half[c][i] /= 1e-10f + sample[c][i];
        }
    }
    return half;
}

}  // namespace relume::jobs
