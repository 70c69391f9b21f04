#include "server/jobs/noise_rule.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/parallel.h"
#include "server/jobs/spread.h"
#include "server/jobs/variance_level.h"

namespace relume::jobs {
namespace {

constexpr int kPoolRadius = 2, kEventRadius = 7;
// Pixels whose features differ by less look at the same thing: squared distances.
constexpr float kAlbedoApart = 0.02f, kNormalApart = 0.1f, kDepthApart = 0.01f;
constexpr float kEpsilon = 1e-3f;
constexpr double kUnseen = 0.05;  // chance that an event so frequent was not seen

// Calls f(i, x, y) for all pixels, in parallel.
template <class F>
void ForPixels(const Film& film, F&& f) {
    const auto width = static_cast<std::size_t>(film.width());
    ParallelFor(0, static_cast<std::size_t>(film.height()), 8, [&](std::size_t y0, std::size_t y1) {
        for (std::size_t y = y0; y < y1; ++y) {
            for (std::size_t x = 0; x < width; ++x) {
                f(y * width + x, static_cast<int>(x), static_cast<int>(y));
            }
        }
    });
}

// Calls f(j) for the pixels of a window about (x, y), clipped at the border, in order.
template <class F>
void ForWindow(const Film& film, int x, int y, int radius_x, int radius_y, F&& f) {
    for (int v = std::max(y - radius_y, 0); v <= std::min(y + radius_y, film.height() - 1); ++v) {
        for (int u = std::max(x - radius_x, 0); u <= std::min(x + radius_x, film.width() - 1);
             ++u) {
            f(static_cast<std::size_t>(v) * static_cast<std::size_t>(film.width()) +
              static_cast<std::size_t>(u));
        }
    }
}

// Largest sample and number of samples in the events' window: rows first, then columns.
struct Neighbourhood {
    std::vector<float> largest;
    std::vector<double> count;
};
Neighbourhood Surroundings(const Film& film) {
    Neighbourhood rows{std::vector<float>(film.pixel_count()),
                       std::vector<double>(film.pixel_count())};
    Neighbourhood all = rows;
    const auto largest = film.Plane(kMaxLuminance);
    ForPixels(film, [&](std::size_t i, int x, int y) {
        ForWindow(film, x, y, kEventRadius, 0, [&](std::size_t j) {
            rows.largest[i] = std::max(rows.largest[i], largest[j]);
            rows.count[i] += film.SampleCount(j);
        });
    });
    ForPixels(film, [&](std::size_t i, int x, int y) {
        ForWindow(film, x, y, 0, kEventRadius, [&](std::size_t j) {
            all.largest[i] = std::max(all.largest[i], rows.largest[j]);
            all.count[i] += rows.count[j];
        });
    });
    return all;
}

// What a pixel looks at: its features' means.
using Look = std::array<float, kFeatureCount>;

std::vector<Look> Looks(const Film& film) {
    std::vector<Look> looks(film.pixel_count());
    for (std::size_t f = 0; f < kFeatureCount; ++f) {
        const auto a = film.Plane(kFeatureMeanA + static_cast<int>(f));
        const auto b = film.Plane(kFeatureMeanB + static_cast<int>(f));
        for (std::size_t i = 0; i < looks.size(); ++i) {
            looks[i][f] = 0.5f * (a[i] + b[i]);
        }
    }
    return looks;
}

bool Alike(const Look& one, const Look& other) {
    const auto apart = [&](std::size_t first, std::size_t count) {
        float sum = 0;
        for (std::size_t f = first; f < first + count; ++f) {
            const float d = one[f] - other[f];
            sum += d * d;
        }
        return sum;
    };
    return apart(kAlbedoR, 3) <= kAlbedoApart && apart(kNormalX, 3) <= kNormalApart &&
           apart(kDepth, 1) <= kDepthApart * one[kDepth] * one[kDepth];
}

}  // namespace

std::vector<float> RelativeDeviation(const Film& film) {
    const auto level = VarianceLevel(film);
    const Neighbourhood around = Surroundings(film);
    const std::vector<Look> looks = Looks(film);
    std::vector<float> deviation(film.pixel_count());
    ForPixels(film, [&](std::size_t i, int x, int y) {
        // Pooled: squared deviations over degrees of freedom, and sums over samples.
        std::array<double, 3> m2{}, sum{};
        double freedom = 0, samples = 0;
        ForWindow(film, x, y, kPoolRadius, kPoolRadius, [&](std::size_t j) {
            if (!Alike(looks[i], looks[j])) {
                return;
            }
            const float n = film.SampleCount(j);
            const Rgb mean = film.Mean(j);
            samples += n;
            freedom += std::max(0.0f, n - 2);
            for (std::size_t c = 0; c < 3; ++c) {
                m2[c] += film.Plane(kM2A + static_cast<int>(c))[j] +
                         film.Plane(kM2B + static_cast<int>(c))[j];
                sum[c] += n * mean[static_cast<int>(c)];
            }
        });
        // p of the most frequent event that nobody needs to have seen. It would make the mean
        // brighter, too.
        const double p = around.count[i] > 0 ? 1 - std::pow(kUnseen, 1 / around.count[i]) : 1;
        const double event = around.largest[i];
        double relative = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const double pooled = freedom > 0 ? m2[c] / freedom * level[c][i] : 0;
            const double mean = samples > 0 ? sum[c] / samples : 0;
            const double with_event = mean + p * event;
            relative +=
                std::max(pooled / (mean * mean + kEpsilon),
                         p * (1 - p) * event * event / (with_event * with_event + kEpsilon));
        }
        deviation[i] = static_cast<float>(std::sqrt(relative / 3));
    });
    return deviation;
}

std::vector<std::uint32_t> ShareByDeviation(std::span<const std::uint32_t> planned,
                                            const std::vector<float>& deviation,
                                            std::uint64_t budget, std::uint32_t salt) {
    const std::size_t pixels = planned.size();
    // A pixel of deviation s gets lambda s - n, at least 0 and at most 3 n: lambda by bisection.
    const auto wish = [&](std::size_t i, double lambda) {
        const double n = planned[i];
        return std::clamp(lambda * static_cast<double>(deviation[i]) - n, 0.0, 3 * n);
    };
    double low = 0, high = 1;
    const auto total = [&](double lambda) {
        double sum = 0;
        for (std::size_t i = 0; i < pixels; ++i) {
            sum += wish(i, lambda);
        }
        return sum;
    };
    const double target = static_cast<double>(budget);
    while (total(high) < target && high < 1e30) {
        high *= 2;
    }
    for (int step = 0; step < 60; ++step) {
        const double middle = 0.5 * (low + high);
        (total(middle) < target ? low : high) = middle;
    }
    std::vector<std::uint32_t> counts(pixels);
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
        // Pairs, rounded up or down by a number of the pixel's own.
        std::uint32_t hash = static_cast<std::uint32_t>(i) * 0x9e3779b9u + salt * 0x85ebca6bu;
        hash ^= hash >> 16;
        hash *= 0x7feb352du;
        hash ^= hash >> 15;
        hash *= 0x846ca68bu;
        hash ^= hash >> 16;
        const double pairs = 0.5 * wish(i, low) + hash * 0x1p-32;
        counts[i] = 2 * static_cast<std::uint32_t>(pairs);
        sum += counts[i];
    }
    if (sum > budget) {
        ScaleDown(budget, &counts);
    } else if (sum > 0) {
        const std::vector<std::uint32_t> rest = SpreadEvenly(pixels, budget - sum, 2);
        for (std::size_t i = 0; i < pixels; ++i) {
            counts[i] += rest[i];
        }
    }
    return counts;
}

}  // namespace relume::jobs
