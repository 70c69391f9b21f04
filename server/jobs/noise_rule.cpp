#include "server/jobs/noise_rule.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/clones.h"
#include "core/base/parallel.h"
#include "server/jobs/box_mean.h"
#include "server/jobs/variance_level.h"

namespace relume::jobs {
namespace {

constexpr float kEpsilon = 1e-3f;
constexpr int kRadius = 4;
constexpr int kBox = 2 * kRadius + 1;
constexpr int kStrip = 128;  // pixels of a row at a time: their planes stay in the nearest cache
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
    const auto count_a = film.Plane(kCountA), count_b = film.Plane(kCountB);
    for (std::size_t i = 0; i < pixels; ++i) {
        planes.inverse_depth2[i] = 1 / (kDepthApart * planes.depth[i] * planes.depth[i] + 1e-30f);
        planes.samples[i] = count_a[i] + count_b[i];
        planes.freedom[i] = std::max(0.0f, planes.samples[i] - 2);
    }
    for (int c = 0; c < 3; ++c) {
        const auto k = static_cast<std::size_t>(c);
        planes.albedo[k] = feature(kAlbedoR + c, 1 / std::sqrt(kAlbedoApart));
        planes.normal[k] = feature(kNormalX + c, 1 / std::sqrt(kNormalApart));
        planes.m2[k].resize(pixels);
        planes.sum[k].resize(pixels);
        const auto a = film.Plane(kM2A + c), b = film.Plane(kM2B + c);
        const auto mean_a = film.Plane(kMeanA + c), mean_b = film.Plane(kMeanB + c);
        for (std::size_t i = 0; i < pixels; ++i) {
            planes.m2[k][i] = level[k][i] * (a[i] + b[i]);
            planes.sum[k][i] = count_a[i] * mean_a[i] + count_b[i] * mean_b[i];
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

// What a pixel is compared by, and what it gives to its neighbours, each at the first pixel of a
// row or of a part of it.
struct Compared {
    const float *a0, *a1, *a2, *n0, *n1, *n2, *depth;
};
struct Given {
    const float *samples, *freedom, *v0, *v1, *v2, *s0, *s1, *s2;
};

Compared ComparedAt(const Planes& p, std::size_t i) {
    return {p.albedo[0].data() + i, p.albedo[1].data() + i, p.albedo[2].data() + i,
            p.normal[0].data() + i, p.normal[1].data() + i, p.normal[2].data() + i,
            p.depth.data() + i};
}

// Adds what the `count` neighbours `there` give to the pixels `here`.
RELUME_CLONES void AddNeighbours(const Compared& here, const float* inverse_depth2,
                                 const Compared& there, const Given& given, std::size_t count,
                                 float* __restrict samples, float* __restrict freedom,
                                 float* __restrict v0, float* __restrict v1, float* __restrict v2,
                                 float* __restrict s0, float* __restrict s1, float* __restrict s2) {
    for (std::size_t k = 0; k < count; ++k) {
        const float a0 = here.a0[k] - there.a0[k], a1 = here.a1[k] - there.a1[k];
        const float a2 = here.a2[k] - there.a2[k], n0 = here.n0[k] - there.n0[k];
        const float n1 = here.n1[k] - there.n1[k], n2 = here.n2[k] - there.n2[k];
        const float depth = here.depth[k] - there.depth[k];
        const float apart = 1 + (a0 * a0 + a1 * a1 + a2 * a2 + n0 * n0 + n1 * n1 + n2 * n2 +
                                 depth * depth * inverse_depth2[k]);
        const float weight = 1 / (apart * apart);
        samples[k] += weight * given.samples[k];
        freedom[k] += weight * given.freedom[k];
        v0[k] += weight * given.v0[k];
        v1[k] += weight * given.v1[k];
        v2[k] += weight * given.v2[k];
        s0[k] += weight * given.s0[k];
        s1[k] += weight * given.s1[k];
        s2[k] += weight * given.s2[k];
    }
}

// The same for pixels [i, i + count), [x, x + count) of their row, and neighbours [j, j + count).
void AddNeighbours(const Planes& p, std::size_t i, std::size_t j, std::size_t x, std::size_t count,
                   Row* row) {
    const Given given = {p.samples.data() + j, p.freedom.data() + j, p.m2[0].data() + j,
                         p.m2[1].data() + j,   p.m2[2].data() + j,   p.sum[0].data() + j,
                         p.sum[1].data() + j,  p.sum[2].data() + j};
    AddNeighbours(ComparedAt(p, i), p.inverse_depth2.data() + i, ComparedAt(p, j), given, count,
                  row->samples.data() + x, row->freedom.data() + x, row->m2[0].data() + x,
                  row->m2[1].data() + x, row->m2[2].data() + x, row->sum[0].data() + x,
                  row->sum[1].data() + x, row->sum[2].data() + x);
}

// Along a side of an image whose other side is `across` pixels: a thin image's windows are longer,
// so that a pixel has as many neighbours as elsewhere.
int RadiusAlong(int across) { return across >= kBox ? kRadius : kBox * kBox / across / 2; }

// The neighbours of the pixels of one row, or of a part of it: every second one, as on a chess
// board, is as good as all.
void AddAround(const Planes& planes, int width, int height, const TileRect& part, Row* row) {
    const int y = part.y0;
    const auto at = [&](int x, int line) {
        return static_cast<std::size_t>(line) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(x);
    };
    const int radius_x = RadiusAlong(height), radius_y = RadiusAlong(width);
    for (int dy = std::max(-radius_y, -y); dy <= std::min(radius_y, height - 1 - y); ++dy) {
        for (int dx = -radius_x; dx <= radius_x; ++dx) {
            if ((dx == 0 && dy == 0) || (dx + dy) % 2 != 0) {
                continue;
            }
            const int first = std::max(part.x0, -dx), last = std::min(part.x1, width - dx);
            if (first < last) {
                AddNeighbours(planes, at(first, y), at(first + dx, y + dy),
                              static_cast<std::size_t>(first),
                              static_cast<std::size_t>(last - first), row);
            }
        }
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
            for (int x0 = 0; x0 < width; x0 += kStrip) {
                AddAround(planes, width, height, {x0, y, std::min(width, x0 + kStrip), y + 1},
                          &row);
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
