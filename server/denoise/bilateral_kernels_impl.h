// Body of the kernels, included by one source per instruction set with RELUME_LANES (floats a
// vector) defined.
#include "server/denoise/bilateral_kernels.h"
#include "server/denoise/lanes_impl.h"
#include "server/denoise/pair_rows_impl.h"

namespace relume::denoise {
namespace {

static_assert(kTileWidth % RELUME_LANES == 0 && kTileWidth % 16 == 0);

// One pixel vector against its neighbours: equation (7) without spatial and range terms, D squared,
// one distance a feature (8): e = sum over features of |df|^2 / max(spread_i + spread_j, floor).
// The three quotients share one division.
struct BankCenter {
    Floats feature[7], spread[3];
};

template <class Planes>
inline BankCenter LoadBankCenter(const Planes& planes, std::ptrdiff_t at) {
    BankCenter center;
    for (int f = 0; f < 7; ++f) {
        center.feature[f] = Load(planes[kBankNormal + f] + at);
    }
    for (int g = 0; g < 3; ++g) {
        center.spread[g] = Load(planes[kBankSpread + g] + at);
    }
    return center;
}

template <class Planes>
inline Floats FeatureDistance(const Planes& planes, std::ptrdiff_t at, const BankCenter& center,
                              const Floats (&floor)[3]) {
    Floats squared[7];
    for (int f = 0; f < 7; ++f) {
        const Floats d = Load(planes[kBankNormal + f] + at) - center.feature[f];
        squared[f] = d * d;
    }
    const Floats normal = squared[0] + squared[1] + squared[2];
    const Floats albedo = squared[3] + squared[4] + squared[5];
    const Floats a = Max(center.spread[0] + Load(planes[kBankSpread] + at), floor[0]);
    const Floats b = Max(center.spread[1] + Load(planes[kBankSpread + 1] + at), floor[1]);
    const Floats c = Max(center.spread[2] + Load(planes[kBankSpread + 2] + at), floor[2]);
    const Floats ab = a * b;
    return ((normal * b + albedo * a) * c + squared[6] * ab) / (ab * c);
}

// The weight, and, for the robust filter, its exponent.
template <int kKindCount>
struct BankPair {
    static constexpr int kKinds = kKindCount, kExponents = kKinds - 1;
    using Center = BankCenter;

    Center LoadCenter(std::ptrdiff_t at) const { return LoadBankCenter(planes, at); }
    void Exponents(const Center& center, std::ptrdiff_t at, Floats (&e)[kKinds]) const {
        e[0] = FeatureDistance(planes, at, center, floor);
        e[kKinds - 1] = e[0];
    }

    PairPlanes planes;
    Floats floor[3];
};

void Bank(const float* first_plane, const BankTables& tables, int columns, int height,
          float* scratch, float* out) {
    const int width = RoundUp(columns);
    const PairPlanes planes = {first_plane};
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; x += RELUME_LANES) {
            for (int k = 0; k < kCandidates; ++k) {
                Store(out + BankSum(y, k, 0) + x, Fill(1.0f));
                for (int c = 0; c < 3; ++c) {
                    Store(out + BankSum(y, k, 1 + c) + x,
                          Load(planes[kBankColor + c] + y * kPairStride + x));
                }
            }
        }
    }
    const BankPair<1> pair = {
        planes, {Fill(tables.floor[0]), Fill(tables.floor[1]), Fill(tables.floor[2])}};
    const auto add = [&](const RowRings<1>& rings, int y, int dy) {
        AddRings<kBankSums>(
            tables, rings, dy, width,
            [&](const auto& ring, int x, Floats(&sum)[kBankSums]) {
                for (std::size_t n = 0; n < sizeof(ring.weight) / sizeof(ring.weight[0]); ++n) {
                    const Floats w = Load(ring.weight[n] + x);
                    const std::ptrdiff_t at = y * kPairStride + x + ring.offset[n];
                    sum[0] += w;
                    for (int c = 0; c < 3; ++c) {
                        sum[1 + c] += w * Load(planes[kBankColor + c] + at);
                    }
                }
            },
            [&](int k, int s) { return out + BankSum(y, k, s); });
    };
    ForEachRow(pair, tables.radius[kCandidates - 1], tables.spatial[kCandidates - 1], width, height,
               scratch, add);
}

void Guide(const float* const* planes, std::ptrdiff_t stride, const BankTables& tables, int height,
           float* out) {
    Floats floor[3];
    for (int g = 0; g < 3; ++g) {
        floor[g] = Fill(tables.floor[g]);
    }
    const int radius = tables.radius[0];
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < kTileWidth; x += RELUME_LANES) {
            const std::ptrdiff_t at = y * stride + x;
            const BankCenter center = LoadBankCenter(planes, at);
            Floats sum[kGuideSums]{};
            for (int dy = -radius; dy <= radius; ++dy) {
                for (int dx = -radius; dx <= radius; ++dx) {
                    const std::ptrdiff_t to = at + dy * stride + dx;
                    const float spatial = tables.spatial[0][dy < 0 ? -dy : dy][dx < 0 ? -dx : dx];
                    const Floats w =
                        ExpOfMinus(FeatureDistance(planes, to, center, floor), kLargestExponent) *
                        spatial;
                    sum[0] += w;
                    for (int c = 0; c < 3; ++c) {
                        sum[1 + c] += w * Load(planes[kBankColor + c] + to);
                        sum[4 + c] += w * w * Load(planes[kBankNoise + c] + to);
                    }
                }
            }
            for (int s = 0; s < kGuideSums; ++s) {
                Store(out + s * kTileArea + y * kTileWidth + x, sum[s]);
            }
        }
    }
}

// What the range term makes of a row of pixels and one of their neighbours.
struct RangeRow {
    float* weight;    // w', at first its exponent
    float* excess;    // the range distance; where it is not above 0 its factor is 1
    float* slope[3];  // r g
};

// The range term's distance: mean over the channels of (g^2 - v_i - min(v_i, v_j)) r (methods 3.7,
// 1.4). `exponent`: of the features' weights.
inline void RangeDistances(const PairPlanes& planes, std::ptrdiff_t row, std::ptrdiff_t offset,
                           const float* exponent, int width, const RangeRow& to) {
    for (int x = 0; x < width; x += RELUME_LANES) {
        const std::ptrdiff_t at = row + x;
        const Floats e = Load(exponent + x);
        Floats slope[3], excess[3], scale[3];
        for (int c = 0; c < 3; ++c) {
            slope[c] =
                Load(planes[kRobustGuide + c] + at + offset) - Load(planes[kRobustGuide + c] + at);
            const Floats own = Load(planes[kRobustNoise + c] + at);
            const Floats v = Load(planes[kRobustNoise + c] + at + offset);
            excess[c] = slope[c] * slope[c] - (own + Min(own, v));
            scale[c] = (own + v) * kRangeScale + kRangeFloor;
        }
        // 1/scale, with one division.
        const Floats whole = 1.0f / (scale[0] * scale[1] * scale[2]);
        const Floats r[3] = {whole * (scale[1] * scale[2]), whole * (scale[0] * scale[2]),
                             whole * (scale[0] * scale[1])};
        Floats distance{};
        for (int c = 0; c < 3; ++c) {
            distance += excess[c] * r[c];
            Store(to.slope[c] + x, slope[c] * r[c]);
        }
        distance *= 1.0f / 3.0f;
        Store(to.excess + x, distance);
        Store(to.weight + x, e + Max(distance, Floats{}));
    }
}

// `near` is the guide's spatial weight, 0 outside of its window.
inline void AddRobustNeighbour(const PairPlanes& planes, std::ptrdiff_t at, std::ptrdiff_t offset,
                               Floats w, const RangeRow& range, int x, float near,
                               Floats (&sum)[kRobustSums]) {
    const Floats ranged = Load(range.weight + x);
    Floats falling = Load(range.excess + x) > Floats{} ? ranged : Floats{};
    if (near > 0) {
        falling -= falling * (w * near) * Load(planes[kRobustShare] + at + offset) /
                   Load(planes[kRobustShare] + at);
    }
    sum[kRobustWeight] += w;
    sum[kRangeWeight] += ranged;
    for (int c = 0; c < 3; ++c) {
        const Floats u =
            Load(planes[kBankColor + c] + at + offset) - Load(planes[kBankColor + c] + at);
        sum[kRobustDelta + c] += w * u;
        sum[kRangeDelta + c] += ranged * u;
        const Floats t = falling * Load(range.slope[c] + x);
        sum[kRangeSlope + c] += t;
        sum[kRangeCurve + c] += t * u;
    }
}

void Robust(const float* first_plane, const BankTables& tables, int columns, int height,
            float* scratch, float* out) {
    const int width = RoundUp(columns);
    const PairPlanes planes = {first_plane};
    __builtin_memset(out, 0, sizeof(float) * static_cast<std::size_t>(RobustSum(height, 0, 0)));
    const BankPair<2> pair = {
        planes, {Fill(tables.floor[0]), Fill(tables.floor[1]), Fill(tables.floor[2])}};
    RangeRow ranges[4];
    for (int n = 0; n < 4; ++n) {
        float* at = scratch + 2 * kPairScratch + n * 5 * kPairWidth;
        ranges[n] = {
            at, at + kPairWidth, {at + 2 * kPairWidth, at + 3 * kPairWidth, at + 4 * kPairWidth}};
        __builtin_memset(at, 0, 5 * kPairWidth * sizeof(float));
    }
    const auto add_ring = [&](const auto& ring, int y, int dy, int dx) {
        constexpr int kCount = sizeof(ring.weight) / sizeof(ring.weight[0]);
        const int first = FirstWindow(tables, dy, dx);
        const float near = first == 0 ? tables.spatial[0][dy][dx] : 0;
        for (int n = 0; n < kCount; ++n) {
            RangeDistances(planes, y * kPairStride, ring.offset[n],
                           ring.weight[n] + PairRow<2>::kStride, width, ranges[n]);
            for (int x = 0; x < width; x += RELUME_LANES) {
                float* at = ranges[n].weight + x;
                Store(at, ExpOfMinus(Load(at), kLargestExponent));
            }
        }
        for (int x = 0; x < width; x += RELUME_LANES) {
            Floats sum[kRobustSums]{};
            for (int n = 0; n < kCount; ++n) {
                AddRobustNeighbour(planes, y * kPairStride + x, ring.offset[n],
                                   Load(ring.weight[n] + x), ranges[n], x, near, sum);
            }
            for (int k = first; k < kCandidates; ++k) {
                const float spatial = tables.spatial[k][dy][dx];
                for (int s = 0; s < kRobustSums; ++s) {
                    float* total = out + RobustSum(y, k, s) + x;
                    Store(total, Load(total) + sum[s] * spatial);
                }
            }
        }
    };
    const int radius = tables.radius[kCandidates - 1];
    const auto& spatial = tables.spatial[kCandidates - 1];
    ForEachRow(pair, radius, spatial, width, height, scratch,
               [&](const RowRings<2>& rings, int y, int dy) {
                   for (int dx = dy == 0 ? 1 : 0; dx <= radius; ++dx) {
                       if (spatial[dy][dx] != 0) {
                           rings.At(dx, [&](const auto& ring) { add_ring(ring, y, dy, dx); });
                       }
                   }
               });
}

// Equation (14) by (15): exp(-(g_i^2 + g_j^2)/(2 sigma^2)) times the first terms of the series of
// exp(lambda), lambda = g_i g_j / sigma^2. Beyond lambda = 80 the sum would overflow: directly
// there.
inline Floats GradientWeight(Floats gi, Floats gj, const PrintedTables& tables) {
    const float scale = 1 / (tables.sigma_s * tables.sigma_s);
    const Floats difference = gj - gi;
    const Floats direct = ExpOfMinus(difference * difference * (0.5f * scale), 87.0f);
    if (tables.taylor == 0) {
        return direct;
    }
    const Floats lambda = gi * gj * scale;
    Floats term = Fill(1.0f), series = term;
    for (int n = 1; n <= tables.taylor; ++n) {
        term *= lambda * (1.0f / static_cast<float>(n));
        series += term;
    }
    const Floats front = ExpOfMinus((gi * gi + gj * gj) * (0.5f * scale), 87.0f);
    return lambda > 80.0f ? direct : front * series;
}

void Printed(const float* const* planes, std::ptrdiff_t stride, const PrintedTables& tables,
             int height, float* out) {
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < kTileWidth; x += RELUME_LANES) {
            const std::ptrdiff_t at = y * stride + x;
            Floats center[kPrintedPlanes];
            for (int p = 0; p < kPrintedPlanes; ++p) {
                center[p] = Load(planes[p] + at);
            }
            Floats neighbours{}, sum[9]{};
            for (int dy = -kPrintedRadius; dy <= kPrintedRadius; ++dy) {
                for (int dx = -kPrintedRadius; dx <= kPrintedRadius; ++dx) {
                    if (dx == 0 && dy == 0) {
                        continue;
                    }
                    const std::ptrdiff_t to = at + dy * stride + dx;
                    const auto squares = [&](int first, int count) {
                        Floats s{};
                        for (int p = first; p < first + count; ++p) {
                            const Floats d = Load(planes[p] + to) - center[p];
                            s += d * d;
                        }
                        return s;
                    };
                    // Range and features, (7) and (8): D is a root, and is used without a square.
                    Floats e = squares(kPrintedColor, 3) * tables.range_scale;
                    const Floats distance[3] = {squares(kPrintedNormal, 3),
                                                squares(kPrintedAlbedo, 3),
                                                squares(kPrintedDepth, 1)};
                    for (int g = 0; g < 3; ++g) {
                        const Floats variance =
                            center[kPrintedVariance + g] + Load(planes[kPrintedVariance + g] + to);
                        e += Sqrt(distance[g] / Max(variance, Fill(1e-10f))) *
                             tables.feature_scale[g];
                    }
                    // The gradient in place of the spatial kernel, (13).
                    const Floats gj = Load(planes[kPrintedGradient] + to);
                    const Floats step = gj - center[kPrintedGradient];
                    const Floats size = Max(step, -step);
                    const float inverse =
                        tables.inverse_distance[dy < 0 ? -dy : dy][dx < 0 ? -dx : dx];
                    const Floats slope = size < 1e-12f ? Floats{} : size * inverse;
                    const Floats w = slope * GradientWeight(center[kPrintedGradient], gj, tables) *
                                     ExpOfMinus(e, 80.0f);
                    neighbours += w;
                    for (int c = 0; c < 9; ++c) {
                        sum[c] += w * Load(planes[kPrintedColor + c] + to);
                    }
                }
            }
            for (int c = 0; c < 9; ++c) {
                const Floats own = center[kPrintedColor + c];
                const Floats filtered = (own + sum[c]) / (neighbours + 1.0f);
                Store(out + c * kTileArea + y * kTileWidth + x,
                      neighbours < 1e-12f ? own : filtered);
            }
        }
    }
}

}  // namespace
}  // namespace relume::denoise
