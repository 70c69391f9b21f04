#include "server/jobs/variance_level.h"

#include <algorithm>
#include <span>

#include "core/base/clones.h"
#include "core/base/parallel.h"
#include "server/jobs/box_mean.h"

namespace relume::jobs {
namespace {

constexpr std::size_t kGrain = 4096;  // pixels a task

struct Halves {
    const float *count_a, *count_b, *mean_a, *mean_b, *m2_a, *m2_b;
};

// Of the mean of all samples, as Film::MeanVariance and Film::HalfVariance have it.
RELUME_CLONES void Variances(const Halves& in, std::size_t pixels, float* __restrict by_samples,
                             float* __restrict by_halves) {
    for (std::size_t i = 0; i < pixels; ++i) {
        const float a = in.count_a[i], b = in.count_b[i], n = a + b;
        const float inverse = 1 / std::max(n * n, 1.0f);
        const float va = in.m2_a[i] * a / std::max(a - 1, 1.0f);
        const float vb = in.m2_b[i] * b / std::max(b - 1, 1.0f);
        const float delta = in.mean_a[i] - in.mean_b[i];
        by_samples[i] = (va + vb) * inverse;
        by_halves[i] = delta * delta * (a * b) * inverse;
    }
}

}  // namespace

std::array<std::vector<float>, 3> VarianceLevel(const Film& film) {
    std::array<std::vector<float>, 3> sample, half;
    const auto count_a = film.Plane(kCountA), count_b = film.Plane(kCountB);
    for (int c = 0; c < 3; ++c) {
        std::vector<float>&by_samples = sample[static_cast<std::size_t>(c)],
        &by_halves = half[static_cast<std::size_t>(c)];
        by_samples.resize(film.pixel_count());
        by_halves.resize(film.pixel_count());
        ParallelFor(0, film.pixel_count(), kGrain, [&](std::size_t i, std::size_t end) {
            const auto from = [&](std::span<const float> plane) { return plane.data() + i; };
            Variances({from(count_a), from(count_b), from(film.Plane(kMeanA + c)),
                       from(film.Plane(kMeanB + c)), from(film.Plane(kM2A + c)),
                       from(film.Plane(kM2B + c))},
                      end - i, by_samples.data() + i, by_halves.data() + i);
        });
    }
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
