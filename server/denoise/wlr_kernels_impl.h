// Body of the kernels, included by one source per instruction set with RELUME_LANES (floats a
// vector) defined. As many pixels as a vector has lanes are fitted side by side.
#include "server/denoise/bilateral_kernels.h"
#include "server/denoise/wlr_subspace_impl.h"

namespace relume::denoise {
namespace {

constexpr int kWindow = (2 * kWlrRadius + 1) * (2 * kWlrRadius + 1);
// Unknowns of the quadratic fit beside the constant, and with the colours.
constexpr int kQuadratic = 2 * kColumns, kQuadraticColumns = kQuadratic + 3;

inline Floats Reciprocal(Floats x) { return x > 0.0f ? 1.0f / x : Floats{}; }
inline Floats Absolute(Floats x) { return Max(x, Floats{} - x); }

// The neighbours of a pixel that may have a say, in the subspace. Memory: WlrTile::scratch.
struct Neighbours {
    int count = 0;
    Floats* trust;     // 0 where a lane rejects it
    Floats* variance;  // of the grey mean
    Floats* color;     // three each, relative to the pixel
    Floats* place;     // `most` coordinates each, relative to the pixel
    Floats* weight;    // of the fit at hand

    explicit Neighbours(float* scratch)
        : trust(reinterpret_cast<Floats*>(scratch)),
          variance(trust + kWindow),
          color(variance + kWindow),
          place(color + 3 * kWindow),
          weight(place + kColumns * kWindow) {}
};

// A neighbour is rejected if the greys differ by more than noise explains.
__attribute__((noinline)) void FindNeighbours(const WlrTile& tile, std::ptrdiff_t center,
                                              const Subspace& space, Neighbours* out) {
    const auto plane = [&](int p, std::ptrdiff_t at) { return Load(tile.planes[p] + at); };
    const float inverse_radius = 1.0f / static_cast<float>(tile.radius);
    const Floats grey = plane(kWlrGrey, center), deviation = plane(kWlrDeviation, center);
    Floats middle[kWlrFeatures], color[3];
    for (int f = 0; f < kWlrFeatures; ++f) {
        middle[f] = plane(kWlrFeature + f, center);
    }
    for (int c = 0; c < 3; ++c) {
        color[c] = plane(kWlrColor + c, center);
    }
    const int most = space.most;
    int n = 0;
    ForWindow(tile, center, [&](std::ptrdiff_t at, int dx, int dy) {
        const Floats difference = Absolute(plane(kWlrGrey, at) - grey);
        const Floats allowed = (deviation + plane(kWlrDeviation, at)) * 3.0f + 0.005f;
        const Floats trust = difference > allowed ? Floats{} : plane(kWlrTrust, at);
        if (!AnyBelow(Floats{} - trust, 0)) {
            return;
        }
        out->trust[n] = trust;
        out->variance[n] = plane(kWlrVariance, at);
        for (int c = 0; c < 3; ++c) {
            out->color[3 * n + c] = plane(kWlrColor + c, at) - color[c];
        }
        Floats column[kWlrFeatures];
#pragma GCC unroll 7
        for (int f = 0; f < kWlrFeatures; ++f) {
            column[f] = plane(kWlrFeature + f, at) - middle[f];
        }
        const float x = static_cast<float>(dx) * inverse_radius;
        const float y = static_cast<float>(dy) * inverse_radius;
        for (int q = 0; q < most; ++q) {
            Floats z = space.axis[q][0] * x + space.axis[q][1] * y;
#pragma GCC unroll 7
            for (int f = 0; f < kWlrFeatures; ++f) {
                z += space.axis[q][2 + f] * column[f];
            }
            out->place[n * most + q] = z;
        }
        ++n;
    });
    out->count = n;
}

// Product of Epanechnikov kernels 3/4 (1 - z^2 narrowness) of the coordinates, `three_quarters`
// being the power of 3/4.
inline Floats Epanechnikov(const Floats* place, int most, const Floats* narrowness,
                           Floats three_quarters) {
    Floats w = three_quarters;
    for (int q = 0; q < most; ++q) {
        w *= Max(1.0f - place[q] * place[q] * narrowness[q], Floats{});
    }
    return w;
}

inline Floats PowerOfThreeQuarters(Floats dimensions) {
    Floats power = Fill(1.0f);
    for (int q = 0; q < kColumns; ++q) {
        power *= dimensions > static_cast<float>(q) ? Fill(0.75f) : Fill(1.0f);
    }
    return power;
}

// L D L^T of the symmetric matrix whose lower half is given, in place; the diagonal becomes 1/D, 0
// where a pivot is not positive: that column takes no part.
inline void Factorise(Floats* a, int n, int stride) {
    for (int k = 0; k < n; ++k) {
        Floats pivot = a[k * stride + k];
        for (int m = 0; m < k; ++m) {
            pivot -= a[k * stride + m] * a[k * stride + m] * a[m * stride + m];
        }
        const Floats inverse = Reciprocal(pivot);
        a[k * stride + k] = inverse;
        for (int i = k + 1; i < n; ++i) {
            Floats value = a[i * stride + k];
            for (int m = 0; m < k; ++m) {
                value -= a[i * stride + m] * (a[k * stride + m] * a[m * stride + m]);
            }
            a[i * stride + k] = value;
        }
    }
}

// Second derivatives along the axes, mean over RGB, from a quadratic fit without mixed terms:
// 1/b^2, b the bandwidth of each axis (Moon et al. 2014, section 4.3).
__attribute__((noinline)) void FindNarrowness(const Neighbours& neighbours, const Subspace& space,
                                              Floats three_quarters, Floats* narrowness) {
    constexpr float kRidge = 1e-3f, kFloor = 0.16f;
    const int most = space.most, unknowns = 2 * most, columns = unknowns + 3;
    Floats ones[kColumns];
    for (int q = 0; q < most; ++q) {
        ones[q] = Fill(1.0f);
    }
    WeightedRows rows;
    Floats column[kMostRows][kQuadraticColumns], cross[kQuadratic * kQuadraticColumns]{};
    Floats weight{}, one[kQuadraticColumns]{};
    for (int k = 0; k < kMostRows; ++k) {
        rows.row[k] = column[k];
    }
    for (int k = 0; k < neighbours.count; ++k) {
        const Floats* place = neighbours.place + k * most;
        const Floats valid = neighbours.trust[k] > 0.0f ? three_quarters : Floats{};
        const Floats w = Epanechnikov(place, most, ones, valid);
        if (AnyBelow(Floats{} - w, 0)) {
            Floats* to = column[rows.count];
            for (int q = 0; q < most; ++q) {
                to[q] = place[q];
                to[most + q] = place[q] * place[q];
            }
            for (int c = 0; c < 3; ++c) {
                to[unknowns + c] = neighbours.color[3 * k + c];
            }
            weight += w;
            for (int c = 0; c < columns; ++c) {
                one[c] += to[c] * w;
            }
            rows.weight[rows.count++] = w;
        }
        if (rows.count == kMostRows || k + 1 == neighbours.count) {
            AddProducts(rows, unknowns, columns, cross);
            rows.count = 0;
        }
    }
    // The constant first.
    constexpr int kStride = kQuadratic + 1;
    Floats matrix[kStride * kStride], right[3][kStride];
    const int n = unknowns + 1;
    matrix[0] = weight + kRidge;
    for (int a = 1; a < n; ++a) {
        matrix[a * kStride] = one[a - 1];
        for (int b = 1; b <= a; ++b) {
            matrix[a * kStride + b] = cross[(b - 1) * columns + a - 1];
        }
        matrix[a * kStride + a] += kRidge;
    }
    Factorise(matrix, n, kStride);
    for (int c = 0; c < 3; ++c) {
        Floats* b = right[c];
        b[0] = one[unknowns + c];
        for (int a = 1; a < n; ++a) {
            b[a] = cross[(a - 1) * columns + unknowns + c];
        }
        for (int k = 0; k < n; ++k) {
            for (int m = 0; m < k; ++m) {
                b[k] -= matrix[k * kStride + m] * (b[m] * matrix[m * kStride + m]);
            }
        }
        for (int k = n - 1; k > most; --k) {
            for (int m = k + 1; m < n; ++m) {
                b[k] -= matrix[m * kStride + k] * b[m];
            }
            b[k] *= matrix[k * kStride + k];
        }
    }
    for (int q = 0; q < most; ++q) {
        const int k = 1 + most + q;
        const Floats sum = Absolute(right[0][k]) + Absolute(right[1][k]) + Absolute(right[2][k]);
        narrowness[q] = sum * (2.0f / 3.0f) + kFloor;
    }
}

// Local linear fit: the value at the pixel is a weighted sum of its neighbours, with weights l.
// list[0 .. count) are the neighbours to look at; those without weight are taken from it.
__attribute__((noinline)) void FitLinear(const WlrTile& tile, std::ptrdiff_t center,
                                         const Neighbours& neighbours, const Subspace& space,
                                         const Floats* narrowness, Floats three_quarters, int* list,
                                         int* count, float* out) {
    constexpr float kRidge = 1e-4f;
    const int most = space.most;
    WeightedRows rows;
    Floats weight{}, used{}, one[kColumns]{}, cross[kColumns * kColumns]{};
    int kept = 0;
    for (int k = 0; k < *count; ++k) {
        const int j = list[k];
        const Floats* place = neighbours.place + j * most;
        const Floats w =
            Epanechnikov(place, most, narrowness, neighbours.trust[j] * three_quarters);
        if (AnyBelow(Floats{} - w, 0)) {
            list[kept++] = j;
            neighbours.weight[j] = w;
            weight += w;
            used += w > 0.0f ? Fill(1.0f) : Floats{};
            for (int q = 0; q < most; ++q) {
                one[q] += place[q] * w;
            }
            rows.row[rows.count] = place;
            rows.weight[rows.count++] = w;
        }
        if (rows.count == kMostRows || k + 1 == *count) {
            AddProducts(rows, most, most, cross);
            rows.count = 0;
        }
    }
    *count = kept;
    // The constant last: what the inverse's last column is made of is then but its own row of L.
    constexpr int kStride = kColumns + 1;
    Floats matrix[kStride * kStride], effect[kStride];
    for (int a = 0; a < most; ++a) {
        for (int b = 0; b <= a; ++b) {
            matrix[a * kStride + b] = cross[b * most + a];
        }
        matrix[a * kStride + a] += kRidge;
        matrix[most * kStride + a] = one[a];
    }
    matrix[most * kStride + most] = weight + kRidge;
    Factorise(matrix, most + 1, kStride);
    effect[most] = matrix[most * kStride + most];
    for (int k = most - 1; k >= 0; --k) {
        Floats sum{};
        for (int m = k + 1; m <= most; ++m) {
            sum -= matrix[m * kStride + k] * effect[m];
        }
        effect[k] = sum * matrix[k * kStride + k];
    }

    Floats change[3]{}, variance{};
    Floats positive{}, positive_change[3]{}, positive_variance{};  // of l > 0 alone
    for (int k = 0; k < kept; ++k) {
        const int j = list[k];
        const Floats* place = neighbours.place + j * most;
        Floats l = effect[most];
        for (int q = 0; q < most; ++q) {
            l += effect[q] * place[q];
        }
        l *= neighbours.weight[j];
        const Floats above = Max(l, Floats{});
        positive += above;
        variance += l * l * neighbours.variance[j];
        positive_variance += above * above * neighbours.variance[j];
        for (int c = 0; c < 3; ++c) {
            change[c] += l * neighbours.color[3 * j + c];
            positive_change[c] += above * neighbours.color[3 * j + c];
        }
    }
    const auto plane = [&](int p) { return Load(tile.planes[p] + center); };
    Floats least = plane(kWlrColor) + change[0];
    for (int c = 1; c < 3; ++c) {
        least = Min(least, plane(kWlrColor + c) + change[c]);
    }
    const Floats inverse = Reciprocal(positive);
    const auto alone = (used > 1.0f) & (effect[most] > 0.0f);
    for (int c = 0; c < 3; ++c) {
        const Floats fitted = least < 0.0f ? positive_change[c] * inverse : change[c];
        Store(out + (kWlrValue + c) * kTileArea,
              plane(kWlrColor + c) + (alone ? fitted : Floats{}));
    }
    const Floats fitted = least < 0.0f ? positive_variance * inverse * inverse : variance;
    Store(out + kWlrFitVariance * kTileArea, alone ? fitted : plane(kWlrVariance));
}

// Calls fn(center, space, neighbours, three_quarters, narrowness, out's offset) for every vector of
// pixels.
template <typename Fn>
inline void ForPixels(const WlrTile& tile, const Fn& fn) {
    for (int y = 0; y < tile.height; ++y) {
        for (int x = 0; x < kTileWidth; x += RELUME_LANES) {
            const std::ptrdiff_t center = y * tile.stride + x;
            Subspace space;
            FindSubspace(tile, center, &space);
            Neighbours neighbours(tile.scratch);
            FindNeighbours(tile, center, space, &neighbours);
            const Floats three_quarters = PowerOfThreeQuarters(space.dimensions);
            Floats narrowness[kColumns];
            FindNarrowness(neighbours, space, three_quarters, narrowness);
            int list[kWindow], count = neighbours.count;
            for (int k = 0; k < count; ++k) {
                list[k] = k;
            }
            const auto fit = [&](Floats bandwidth, float* out) {
                Floats scaled[kColumns];
                const Floats inverse = 1.0f / (bandwidth * bandwidth);
                for (int q = 0; q < space.most; ++q) {
                    scaled[q] = narrowness[q] * inverse;
                }
                FitLinear(tile, center, neighbours, space, scaled, three_quarters, list, &count,
                          out);
            };
            fn(y * kTileWidth + x, space, fit);
        }
    }
}

void TryBandwidths(const WlrTile& tile, float* out) {
    ForPixels(tile, [&](int at, const Subspace& space, const auto& fit) {
        // From the widest on: a narrower one has no neighbours that it lacks.
        for (int t = kWlrTrials - 1; t >= 0; --t) {
            fit(Fill(static_cast<float>(t + 1) * 0.2f), out + t * kWlrFitPlanes * kTileArea + at);
        }
        Store(out + kWlrTrials * kWlrFitPlanes * kTileArea + at, space.dimensions);
    });
}

void FitPixels(const WlrTile& tile, const float* bandwidth, float* out) {
    ForPixels(tile, [&](int at, const Subspace&, const auto& fit) {
        fit(Load(bandwidth + at), out + at);
    });
}

}  // namespace
}  // namespace relume::denoise
