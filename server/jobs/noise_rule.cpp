#include "server/jobs/noise_rule.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/parallel.h"
#include "server/jobs/box_mean.h"
#include "server/jobs/variance_level.h"

namespace relume::jobs {
namespace {

constexpr float kEpsilon = 1e-3f;
constexpr int kRadius = 4;
constexpr float kFromAround = 0.5f, kFromAll = 0.01f;
// Squared distances at which a neighbour counts a quarter. Depth: relative.
constexpr float kAlbedoApart = 0.02f, kNormalApart = 0.1f, kDepthApart = 0.01f;

// Rows of plain numbers, so that the inner loop runs over pixels that lie side by side.
struct Planes {
    std::array<std::vector<float>, 3> albedo, normal;  // over the roots of their distances
    std::vector<float> depth, inverse_depth2;          // 1 / (kDepthApart depth^2)
    std::vector<float> samples, freedom;               // degrees of freedom of m2
    // Of RGB: squared deviations at the level of the halves, and sums.
    std::array<std::vector<float>, 3> m2, sum;
};

Planes ReadPlanes(const Film& film) {
    const auto level = VarianceLevel(film);
    const std::size_t pixels = film.pixel_count();
    Planes planes;
    const auto feature = [&](int f, float scale) {
        std::vector<float> out(pixels);
        const auto a = film.Plane(kFeatureMeanA + f), b = film.Plane(kFeatureMeanB + f);
        for (std::size_t i = 0; i < pixels; ++i) {
            out[i] = scale * 0.5f * (a[i] + b[i]);
        }
        return out;
    };
    planes.depth = feature(kDepth, 1);
    for (auto* plane : {&planes.inverse_depth2, &planes.samples, &planes.freedom}) {
        plane->resize(pixels);
    }
    for (std::size_t i = 0; i < pixels; ++i) {
        planes.inverse_depth2[i] = 1 / (kDepthApart * planes.depth[i] * planes.depth[i] + 1e-30f);
        planes.samples[i] = film.SampleCount(i);
        planes.freedom[i] = std::max(0.0f, planes.samples[i] - 2);
    }
    for (int c = 0; c < 3; ++c) {
        const auto k = static_cast<std::size_t>(c);
        planes.albedo[k] = feature(kAlbedoR + c, 1 / std::sqrt(kAlbedoApart));
        planes.normal[k] = feature(kNormalX + c, 1 / std::sqrt(kNormalApart));
        planes.m2[k].resize(pixels);
        planes.sum[k].resize(pixels);
        const auto a = film.Plane(kM2A + c), b = film.Plane(kM2B + c);
        for (std::size_t i = 0; i < pixels; ++i) {
            planes.m2[k][i] = level[k][i] * (a[i] + b[i]);
            planes.sum[k][i] = planes.samples[i] * film.Mean(i)[c];
        }
    }
    return planes;
}

// Weighted sums over the neighbours of a row of pixels.
struct Row {
    explicit Row(std::size_t width) : samples(width), freedom(width) {
        m2.fill(std::vector<float>(width));
        sum = m2;
    }
    std::vector<float> samples, freedom;
    std::array<std::vector<float>, 3> m2, sum;
};

float Square(float x) { return x * x; }

// Adds what pixels [j, j + count) give to those at [i, i + count), which are [x, x + count) of the
// row.
void AddNeighbours(const Planes& p, std::size_t i, std::size_t j, std::size_t x, std::size_t count,
                   Row* row) {
    const auto at = [](const std::vector<float>& v, std::size_t first) { return v.data() + first; };
    const float *a0 = at(p.albedo[0], 0), *a1 = at(p.albedo[1], 0), *a2 = at(p.albedo[2], 0);
    const float *n0 = at(p.normal[0], 0), *n1 = at(p.normal[1], 0), *n2 = at(p.normal[2], 0);
    const float *depth = at(p.depth, 0), *inverse = at(p.inverse_depth2, i);
    const float *samples = at(p.samples, j), *freedom = at(p.freedom, j);
    const float *v0 = at(p.m2[0], j), *v1 = at(p.m2[1], j), *v2 = at(p.m2[2], j);
    const float *s0 = at(p.sum[0], j), *s1 = at(p.sum[1], j), *s2 = at(p.sum[2], j);
    float* __restrict out_samples = row->samples.data() + x;
    float* __restrict out_freedom = row->freedom.data() + x;
    float* __restrict out_v0 = row->m2[0].data() + x;
    float* __restrict out_v1 = row->m2[1].data() + x;
    float* __restrict out_v2 = row->m2[2].data() + x;
    float* __restrict out_s0 = row->sum[0].data() + x;
    float* __restrict out_s1 = row->sum[1].data() + x;
    float* __restrict out_s2 = row->sum[2].data() + x;
    for (std::size_t k = 0; k < count; ++k) {
        const float apart = Square(a0[i + k] - a0[j + k]) + Square(a1[i + k] - a1[j + k]) +
                            Square(a2[i + k] - a2[j + k]) + Square(n0[i + k] - n0[j + k]) +
                            Square(n1[i + k] - n1[j + k]) + Square(n2[i + k] - n2[j + k]) +
                            Square(depth[i + k] - depth[j + k]) * inverse[k];
        const float weight = 1 / Square(1 + apart);
        out_samples[k] += weight * samples[k];
        out_freedom[k] += weight * freedom[k];
        out_v0[k] += weight * v0[k];
        out_v1[k] += weight * v1[k];
        out_v2[k] += weight * v2[k];
        out_s0[k] += weight * s0[k];
        out_s1[k] += weight * s1[k];
        out_s2[k] += weight * s2[k];
    }
}

// Mean over RGB of variance over squared mean, pooled over each pixel's neighbours.
std::vector<float> PoolNeighbours(const Film& film) {
    const Planes planes = ReadPlanes(film);
    const int width = film.width(), height = film.height();
    std::vector<float> relative(film.pixel_count());
    ParallelFor(0, static_cast<std::size_t>(height), 4, [&](std::size_t y0, std::size_t y1) {
        for (int y = static_cast<int>(y0); y < static_cast<int>(y1); ++y) {
            Row row(static_cast<std::size_t>(width));
            for (int dy = std::max(-kRadius, -y); dy <= std::min(kRadius, height - 1 - y); ++dy) {
                for (int dx = -kRadius; dx <= kRadius; ++dx) {
                    // Every second one, as on a chess board, is as good as all.
                    if ((dx == 0 && dy == 0) || (dx + dy) % 2 != 0) {
                        continue;
                    }
                    const int first = std::max(0, -dx), last = std::min(width, width - dx);
                    if (first < last) {
                        const auto i =
                            static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(first);
                        const auto j =
                            static_cast<std::size_t>(y + dy) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(first + dx);
                        AddNeighbours(planes, i, j, static_cast<std::size_t>(first),
                                      static_cast<std::size_t>(last - first), &row);
                    }
                }
            }
            for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
                const std::size_t i =
                    static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + x;
                // A pixel that is alone has but itself.
                const bool alone = row.freedom[x] == 0;
                const float freedom = alone ? planes.freedom[i] : row.freedom[x];
                const float samples = alone ? planes.samples[i] : row.samples[x];
                float sum = 0;
                for (std::size_t c = 0; c < 3 && freedom > 0; ++c) {
                    const float m2 = alone ? planes.m2[c][i] : row.m2[c][x];
                    const float value = alone ? planes.sum[c][i] : row.sum[c][x];
                    sum += m2 / freedom / (Square(value / samples) + kEpsilon);
                }
                // One of which nothing is known is as noisy as it is bright.
                relative[i] = freedom > 0 ? sum / 3 : 1;
            }
        }
    });
    return relative;
}

}  // namespace

std::vector<float> RelativeDeviation(const Film& film) {
    std::vector<float> deviation = PoolNeighbours(film);
    const std::vector<float> around = BoxMean(deviation, film.width(), film.height());
    double all = 0;
    for (const float v : deviation) {
        all += v;
    }
    const auto rest = static_cast<float>(kFromAll * all / static_cast<double>(deviation.size()));
    for (std::size_t i = 0; i < deviation.size(); ++i) {
        deviation[i] = std::sqrt(deviation[i] + kFromAround * around[i] + rest);
    }
    return deviation;
}

}  // namespace relume::jobs
