// Body of the kernels, included by one source per instruction set with RELUME_LANES (floats a
// vector) defined. As many pixels as a vector has lanes are fitted side by side.
#include "server/denoise/regression_kernels.h"
#include "server/denoise/weighted_products_impl.h"

namespace relume::denoise {
namespace {

static_assert(kRegressionGroup % RELUME_LANES == 0 && kRegressionSide <= kMostRows);

constexpr int kR = kRegressionRadius, kSide = kRegressionSide;
constexpr int kMost = kMaxRegressionFeatures;

inline bool AnyPositive(Floats x) { return AnyBelow(Floats{} - x, 0); }

inline Floats Reciprocal(Floats x) { return x > 0.0f ? 1.0f / x : Floats{}; }

// Neighbours at which some lane has a weight, by column of the window.
struct Neighbours {
    int count[kSide];
    int dy[kSide][kSide];
};

// The pixels to fit: lanes x .. x + RELUME_LANES - 1 of row y.
struct Center {
    const float* weights;  // of offset (-kR, -kR)
    std::ptrdiff_t at, sum_at;
    Floats feature[kMost], color[3];

    Floats Weight(int dx, int dy) const {
        return Load(weights + ((dy + kR) * kSide + dx + kR) * kRegressionGroup);
    }
};

// Columns of the design matrix: 1, y, x, features; then the colours. All relative to the centre.
// Columns 1 and y need but the sums of each window row.
struct NormalEquations {
    Floats weight{}, x{}, xx{}, y{}, yy{}, xy{};  // sums of w, w x, ...
    // Of features, then colours: sums of w column, w x column, w y column, and of w column column,
    // on and above the diagonal, a row a feature.
    Floats one[kMost + 3]{}, by_x[kMost + 3]{}, by_y[kMost + 3]{};
    Floats cross[kMost * (kMost + 3)]{};
};

template <int kFeatures>
__attribute__((noinline)) void AddWindow(const RegressionTile& tile, const Center& center,
                                         NormalEquations* sums, Neighbours* neighbours) {
    constexpr int kColumns = kFeatures + 3;
    // Copies that no store can change.
    const float* from[kColumns];
    Floats middle[kColumns];
#pragma GCC unroll 8
    for (int f = 0; f < kFeatures; ++f) {
        from[f] = tile.feature[f] + center.at;
        middle[f] = center.feature[f];
    }
#pragma GCC unroll 3
    for (int c = 0; c < 3; ++c) {
        from[kFeatures + c] = tile.color[c] + center.at;
        middle[kFeatures + c] = center.color[c];
    }
    const std::ptrdiff_t stride = tile.stride;
    const float* weights = center.weights;
    WeightedRows row;
    Floats column[kSide][kColumns];  // relative to the centre
    for (int k = 0; k < kSide; ++k) {
        row.row[k] = column[k];
    }
    for (int& count : neighbours->count) {
        count = 0;
    }
    for (int dy = -kR; dy <= kR; ++dy) {
        row.count = 0;
        Floats weight{}, by_x{}, xx{}, one[kColumns]{}, column_by_x[kColumns]{};
        for (int dx = -kR; dx <= kR; ++dx) {
            const Floats w = Load(weights);
            weights += kRegressionGroup;
            if (!AnyPositive(w)) {
                continue;
            }
            const int place = dx + kR;
            neighbours->dy[place][neighbours->count[place]++] = dy;
            const std::ptrdiff_t shift = dy * stride + dx;
            const auto x = static_cast<float>(dx);
            const Floats wx = w * x;
            weight += w;
            by_x += wx;
            xx += wx * x;
            Floats* to = column[row.count];
            row.weight[row.count++] = w;
#pragma GCC unroll 11
            for (int c = 0; c < kColumns; ++c) {
                const Floats value = Load(from[c] + shift) - middle[c];
                to[c] = value;
                one[c] += w * value;
                column_by_x[c] += wx * value;
            }
        }
        if (row.count == 0) {
            continue;
        }
        const auto y = static_cast<float>(dy);
        sums->weight += weight;
        sums->x += by_x;
        sums->xx += xx;
        sums->y += weight * y;
        sums->yy += weight * (y * y);
        sums->xy += by_x * y;
        for (int c = 0; c < kColumns; ++c) {
            sums->one[c] += one[c];
            sums->by_x[c] += column_by_x[c];
            sums->by_y[c] += one[c] * y;
        }
        AddProducts(row, kFeatures, kColumns, sums->cross);
    }
}

// Coefficients of a channel: of 1, y, x and the features.
struct Fit {
    Floats channel[3][kMost + 3];
};

// Least squares with the intercept eliminated, which so has no ridge: a constant stays one. The
// rest by L D L^T; a pivot that is not positive, a column that the ones before it make, takes no
// part.
__attribute__((noinline)) void Solve(const RegressionTile& tile, const NormalEquations& sums,
                                     Fit* fit) {
    const int features = tile.features, columns = features + 3;
    const int n = features + 2;  // y, x, features
    constexpr int kN = kMost + 2;
    const Floats inverse_weight = Reciprocal(sums.weight);
    Floats mean[kN], lower[kN][kN], right[3][kN];
    mean[0] = sums.y * inverse_weight;
    mean[1] = sums.x * inverse_weight;
    lower[0][0] = sums.yy - sums.y * mean[0];
    lower[1][0] = sums.xy - sums.x * mean[0];
    lower[1][1] = sums.xx - sums.x * mean[1];
    for (int a = 0; a < features; ++a) {
        mean[2 + a] = sums.one[a] * inverse_weight;
        lower[2 + a][0] = sums.by_y[a] - sums.one[a] * mean[0];
        lower[2 + a][1] = sums.by_x[a] - sums.one[a] * mean[1];
        for (int b = 0; b <= a; ++b) {
            lower[2 + a][2 + b] = sums.cross[b * columns + a] - sums.one[a] * mean[2 + b];
        }
    }
    for (int c = 0; c < 3; ++c) {
        const int column = features + c;
        right[c][0] = sums.by_y[column] - sums.one[column] * mean[0];
        right[c][1] = sums.by_x[column] - sums.one[column] * mean[1];
        for (int a = 0; a < features; ++a) {
            right[c][2 + a] = sums.cross[a * columns + column] - sums.one[column] * mean[2 + a];
        }
    }
    const Floats floor = sums.weight * tile.floor;
    Floats inverse[kN];
    for (int k = 0; k < n; ++k) {
        const Floats variance = Max(lower[k][k], Floats{});
        const Floats added = variance * tile.ridge + floor;
        Floats pivot = variance + added;
        for (int m = 0; m < k; ++m) {
            pivot -= lower[k][m] * lower[k][m] * inverse[m];
        }
        // Of what is added half is left at least, but for rounding.
        inverse[k] = Reciprocal(pivot > added * 0.5f ? pivot : Floats{});
        for (int i = k + 1; i < n; ++i) {
            for (int m = 0; m < k; ++m) {
                lower[i][k] -= lower[i][m] * lower[k][m] * inverse[m];
            }
        }
    }
    for (int c = 0; c < 3; ++c) {
        Floats* b = right[c];
        for (int k = 0; k < n; ++k) {
            for (int m = 0; m < k; ++m) {
                b[k] -= lower[k][m] * (b[m] * inverse[m]);
            }
        }
        Floats intercept = sums.one[features + c];
        for (int k = n - 1; k >= 0; --k) {
            Floats value = b[k];
            for (int m = k + 1; m < n; ++m) {
                value -= lower[m][k] * fit->channel[c][1 + m];
            }
            fit->channel[c][1 + k] = value * inverse[k];
        }
        intercept *= inverse_weight;
        for (int k = 0; k < n; ++k) {
            intercept -= fit->channel[c][1 + k] * mean[k];
        }
        fit->channel[c][0] = intercept;
    }
}

// Adds the fit's values at kCount pixels of a window's column dx, in rows `dy`.
template <int kCount>
__attribute__((noinline)) void AddFit(const RegressionTile& tile, const Center& center,
                                      const Fit& fit, int dx, const int* dy) {
    Floats value[kCount][3];
    std::ptrdiff_t shift[kCount];
    const float x = static_cast<float>(dx);
    const Floats base[3] = {center.color[0] + (fit.channel[0][0] + fit.channel[0][2] * x),
                            center.color[1] + (fit.channel[1][0] + fit.channel[1][2] * x),
                            center.color[2] + (fit.channel[2][0] + fit.channel[2][2] * x)};
#pragma GCC unroll 8
    for (int k = 0; k < kCount; ++k) {
        shift[k] = center.at + dy[k] * tile.stride + dx;
#pragma GCC unroll 3
        for (int c = 0; c < 3; ++c) {
            value[k][c] = base[c] + fit.channel[c][1] * static_cast<float>(dy[k]);
        }
    }
    // Not unrolled, lest the compiler load what the registers cannot hold.
#pragma GCC unroll 1
    for (int f = 0; f < tile.features; ++f) {
        const float* from = tile.feature[f];
        const Floats middle = center.feature[f];
        const Floats r = fit.channel[0][3 + f], g = fit.channel[1][3 + f];
        const Floats b = fit.channel[2][3 + f];
#pragma GCC unroll 8
        for (int k = 0; k < kCount; ++k) {
            const Floats difference = Load(from + shift[k]) - middle;
            value[k][0] += r * difference;
            value[k][1] += g * difference;
            value[k][2] += b * difference;
        }
    }
#pragma GCC unroll 8
    for (int k = 0; k < kCount; ++k) {
        const Floats w = center.Weight(dx, dy[k]);
        const std::ptrdiff_t to = center.sum_at + dy[k] * tile.sum_stride + dx;
#pragma GCC unroll 3
        for (int c = 0; c < 3; ++c) {
            Store(tile.sum[c] + to, Load(tile.sum[c] + to) + value[k][c] * w);
        }
        Store(tile.sum[3] + to, Load(tile.sum[3] + to) + w);
    }
}

// Column by column: a store is not read again before the whole column is done, since a vector that
// overlaps a store still in flight waits for it.
void AddFitToColumn(const RegressionTile& tile, const Center& center, const Neighbours& neighbours,
                    const Fit& fit, int dx) {
    const int* dy = neighbours.dy[dx + kR];
    int left = neighbours.count[dx + kR];
    for (; left >= 5; left -= 5, dy += 5) {
        AddFit<5>(tile, center, fit, dx, dy);
    }
    switch (left) {
        case 4:
            return AddFit<4>(tile, center, fit, dx, dy);
        case 3:
            return AddFit<3>(tile, center, fit, dx, dy);
        case 2:
            return AddFit<2>(tile, center, fit, dx, dy);
        case 1:
            return AddFit<1>(tile, center, fit, dx, dy);
    }
}

using AddWindowKernel = void (*)(const RegressionTile&, const Center&, NormalEquations*,
                                 Neighbours*);
constexpr AddWindowKernel kAddWindow[kMost + 1] = {AddWindow<0>, AddWindow<1>, AddWindow<2>,
                                                   AddWindow<3>, AddWindow<4>, AddWindow<5>,
                                                   AddWindow<6>, AddWindow<7>, AddWindow<8>};

// A group of pixels is fitted before any is added, so that sums have the same order for any number
// of lanes.
void Regress(const RegressionTile& tile) {
    constexpr int kVectors = kRegressionGroup / RELUME_LANES;
    for (int y = 0; y < tile.height; ++y) {
        for (int x = 0; x < tile.width; x += kRegressionGroup) {
            Center center[kVectors];
            Neighbours neighbours[kVectors];
            Fit fit[kVectors];
            for (int v = 0; v < kVectors; ++v) {
                const int first = x + v * RELUME_LANES;
                center[v].weights = tile.weights + WeightIndex(first, y, -kR, -kR);
                center[v].at = y * tile.stride + first;
                center[v].sum_at = y * tile.sum_stride + first;
                for (int f = 0; f < tile.features; ++f) {
                    center[v].feature[f] = Load(tile.feature[f] + center[v].at);
                }
                for (int c = 0; c < 3; ++c) {
                    center[v].color[c] = Load(tile.color[c] + center[v].at);
                }
                NormalEquations sums;
                kAddWindow[tile.features](tile, center[v], &sums, &neighbours[v]);
                Solve(tile, sums, &fit[v]);
            }
            for (int dx = -kR; dx <= kR; ++dx) {
                for (int v = 0; v < kVectors; ++v) {
                    AddFitToColumn(tile, center[v], neighbours[v], fit[v], dx);
                }
            }
        }
    }
}

void Sharpen(float* weights, std::ptrdiff_t count) {
    for (std::ptrdiff_t i = 0; i < count; i += RELUME_LANES) {
        const Floats w = Load(weights + i);
        const Floats square = w * w;
        Store(weights + i, square * square);
    }
}

}  // namespace
}  // namespace relume::denoise
