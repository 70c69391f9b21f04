// The space that weighted local regression fits in: the window's principal components that stand
// out of the features' noise. Included only by the bodies of kernels, with RELUME_LANES defined.
#include "server/denoise/weighted_products_impl.h"
#include "server/denoise/wlr_kernels.h"

namespace relume::denoise {
namespace {

constexpr int kColumns = kWlrColumns;

// Calls fn(at, dx, dy) for each pixel of the window around `center`, row by row.
template <typename Fn>
inline void ForWindow(const WlrTile& tile, std::ptrdiff_t center, const Fn& fn) {
    for (int dy = -tile.radius; dy <= tile.radius; ++dy) {
        for (int dx = -tile.radius; dx <= tile.radius; ++dx) {
            fn(center + dy * tile.stride + dx, dx, dy);
        }
    }
}

struct Eigen {
    Floats value[kColumns];
    Floats vector[kColumns][kColumns];  // of each value
};

// Cyclic Jacobi rotations on a symmetric matrix, whose upper half is given and lost. As many sweeps
// as single precision takes, whether needed or not, so that a lane's bits do not depend on its
// neighbours.
__attribute__((noinline)) void FindEigenvectors(Floats (*a)[kColumns], Eigen* eigen) {
    constexpr int kSweeps = 7;
    for (int i = 0; i < kColumns; ++i) {
        for (int j = 0; j < kColumns; ++j) {
            eigen->vector[i][j] = Fill(i == j ? 1.0f : 0.0f);
        }
    }
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
        for (int p = 0; p < kColumns - 1; ++p) {
            for (int q = p + 1; q < kColumns; ++q) {
                const Floats element = a[p][q];
                const Floats half = (a[q][q] - a[p][p]) * 0.5f;
                // tan of the angle, the smaller one: element / (half +- root).
                const Floats root = Sqrt(half * half + element * element);
                const Floats below = half >= 0.0f ? half + root : half - root;
                const Floats t = below != 0.0f ? element / below : Floats{};
                const Floats c = 1.0f / Sqrt(t * t + 1.0f);
                const Floats s = t * c;
                a[p][p] -= t * element;
                a[q][q] += t * element;
                a[p][q] = Floats{};
                for (int k = 0; k < kColumns; ++k) {
                    if (k != p && k != q) {
                        Floats& kp = k < p ? a[k][p] : a[p][k];
                        Floats& kq = k < q ? a[k][q] : a[q][k];
                        const Floats x = kp, y = kq;
                        kp = c * x - s * y;
                        kq = s * x + c * y;
                    }
                    const Floats x = eigen->vector[p][k], y = eigen->vector[q][k];
                    eigen->vector[p][k] = c * x - s * y;
                    eigen->vector[q][k] = s * x + c * y;
                }
            }
        }
    }
    for (int k = 0; k < kColumns; ++k) {
        eigen->value[k] = a[k][k];
    }
    // Largest first.
    for (int end = kColumns - 1; end > 0; --end) {
        for (int k = 0; k < end; ++k) {
            const auto swap = eigen->value[k] < eigen->value[k + 1];
            const auto exchange = [&](Floats& x, Floats& y) {
                const Floats first = x;
                x = swap ? y : x;
                y = swap ? first : y;
            };
            exchange(eigen->value[k], eigen->value[k + 1]);
            for (int j = 0; j < kColumns; ++j) {
                exchange(eigen->vector[k][j], eigen->vector[k + 1][j]);
            }
        }
    }
}

struct Subspace {
    Floats axis[kColumns][kColumns];  // coordinate q of a neighbour: sum of axis[q][k] x column k
    Floats dimensions;                // that count in each lane; coordinates beyond are 0
    int most;                         // in any lane
};

inline Floats Inside(const WlrTile& tile, std::ptrdiff_t at) {
    return Load(tile.planes[kWlrTrust] + at) > 0.0f ? Fill(1.0f) : Floats{};
}

// Columns are centred on the window's mean; each feature is divided by its largest deviation there,
// that of vectors by the vector's, at least kFloor. A component counts if its singular value is
// above twice an estimate of the noise's (Moon et al. 2014, section 4.2), two in any case.
__attribute__((noinline)) void FindSubspace(const WlrTile& tile, std::ptrdiff_t center,
                                            Subspace* space) {
    constexpr float kFloor = 0.01f, kAlways = 2;
    constexpr int kGroupOf[kWlrFeatures] = {0, 1, 1, 1, 2, 2, 2};
    const float inverse_radius = 1.0f / static_cast<float>(tile.radius);
    Floats count{}, mean[kColumns]{}, noise[3]{};
    ForWindow(tile, center, [&](std::ptrdiff_t at, int dx, int dy) {
        const Floats inside = Inside(tile, at);
        count += inside;
        mean[0] += inside * (static_cast<float>(dx) * inverse_radius);
        mean[1] += inside * (static_cast<float>(dy) * inverse_radius);
        for (int f = 0; f < kWlrFeatures; ++f) {
            mean[2 + f] += Load(tile.planes[kWlrFeature + f] + at);
        }
        for (int g = 0; g < 3; ++g) {
            noise[g] += Load(tile.planes[kWlrNoise + g] + at);
        }
    });
    const Floats inverse_count = 1.0f / Max(count, Fill(1.0f));
    for (Floats& value : mean) {
        value *= inverse_count;
    }

    WeightedRows rows;
    Floats column[kMostRows][kColumns], largest[3]{}, cross[kColumns][kColumns]{};
    for (int k = 0; k < kMostRows; ++k) {
        rows.row[k] = column[k];
        rows.weight[k] = Fill(1.0f);
    }
    for (int dy = -tile.radius; dy <= tile.radius; ++dy) {
        rows.count = 0;
        for (int dx = -tile.radius; dx <= tile.radius; ++dx) {
            const std::ptrdiff_t at = center + dy * tile.stride + dx;
            const Floats inside = Inside(tile, at);
            Floats* to = column[rows.count++];
            to[0] = (static_cast<float>(dx) * inverse_radius - mean[0]) * inside;
            to[1] = (static_cast<float>(dy) * inverse_radius - mean[1]) * inside;
            Floats squared[3]{};
#pragma GCC unroll 7
            for (int f = 0; f < kWlrFeatures; ++f) {
                const Floats d = (Load(tile.planes[kWlrFeature + f] + at) - mean[2 + f]) * inside;
                to[2 + f] = d;
                squared[kGroupOf[f]] += d * d;
            }
            for (int g = 0; g < 3; ++g) {
                largest[g] = Max(largest[g], squared[g]);
            }
        }
        AddProducts(rows, kColumns, kColumns, cross[0]);
    }
    Floats scale[kColumns] = {Fill(1.0f), Fill(1.0f)}, noise_sum{};
    for (int f = 0; f < kWlrFeatures; ++f) {
        scale[2 + f] = 1.0f / Max(Sqrt(largest[kGroupOf[f]]), Fill(kFloor));
    }
    for (int g = 0; g < 3; ++g) {
        const Floats s = scale[g == 0 ? 2 : g == 1 ? 3 : 6];
        noise_sum += noise[g] * s * s;
    }
    for (int p = 0; p < kColumns; ++p) {
        for (int q = p; q < kColumns; ++q) {
            cross[p][q] *= scale[p] * scale[q];
        }
    }
    Eigen eigen;
    FindEigenvectors(cross, &eigen);

    // 2 |noise| / (sqrt(columns) / 2), the noise's largest singular value from its Frobenius norm.
    const Floats least = Sqrt(noise_sum) * (4.0f / 3.0f) + 0.01f;
    const Floats least_squared = least * least;
    space->dimensions = Fill(kAlways);
    for (int q = static_cast<int>(kAlways); q < kColumns; ++q) {
        space->dimensions += eigen.value[q] > least_squared ? Fill(1.0f) : Floats{};
    }
    space->most = static_cast<int>(kAlways);
    for (int lane = 0; lane < RELUME_LANES; ++lane) {
        const int d = static_cast<int>(space->dimensions[lane]);
        space->most = d > space->most ? d : space->most;
    }
    for (int q = 0; q < kColumns; ++q) {
        for (int k = 0; k < kColumns; ++k) {
            space->axis[q][k] = space->dimensions > static_cast<float>(q)
                                    ? eigen.vector[q][k] * scale[k]
                                    : Floats{};
        }
    }
}

}  // namespace
}  // namespace relume::denoise
