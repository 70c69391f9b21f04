// Body of the kernels of SBF, included by one source per instruction set with RELUME_LANES (floats
// a vector) defined.
#include "server/denoise/lanes_impl.h"
#include "server/denoise/pair_rows_impl.h"
#include "server/denoise/sbf_kernels.h"

namespace relume::denoise {
namespace {

// Sum over `kTerms` of numerator / denominator as one fraction, left in the first.
template <int kTerms>
inline void AddFractions(Floats* numerator, Floats* denominator) {
    if constexpr (kTerms > 1) {
        for (int i = 0; i < kTerms / 2; ++i) {
            numerator[i] = numerator[2 * i] * denominator[2 * i + 1] +
                           numerator[2 * i + 1] * denominator[2 * i];
            denominator[i] = denominator[2 * i] * denominator[2 * i + 1];
        }
        if constexpr (kTerms % 2 != 0) {
            numerator[kTerms / 2] = numerator[kTerms - 1];
            denominator[kTerms / 2] = denominator[kTerms - 1];
        }
        AddFractions<(kTerms + 1) / 2>(numerator, denominator);
    }
}

// Weights exp(-sum over features of d^2 / max(spread_i + spread_j, 1)): one division for all. With
// the gradient of kinds: its term 0, 1 and 4 times.
template <int kKindCount>
struct SbfPair {
    static constexpr int kKinds = kKindCount, kExponents = 0;
    struct Center {
        Floats feature[kSbfFeatures + 1], spread[kSbfFeatures + 1];
    };

    Center LoadCenter(std::ptrdiff_t at) const {
        Center center;
        for (int f = 0; f < kSbfFeatures; ++f) {
            center.feature[f] = Load(planes[kSbfFeature + f] + at);
            center.spread[f] = Load(planes[kSbfSpread + f] + at);
        }
        if constexpr (kKinds > 1) {
            center.feature[kSbfFeatures] = Load(planes[kSbfGradient] + at);
            center.spread[kSbfFeatures] = Load(planes[kSbfGradient + 1] + at);
        }
        return center;
    }

    void Exponents(const Center& center, std::ptrdiff_t at, Floats (&e)[kKinds]) const {
        Floats square[kSbfFeatures], spread[kSbfFeatures];
        for (int f = 0; f < kSbfFeatures; ++f) {
            const Floats d = Load(planes[kSbfFeature + f] + at) - center.feature[f];
            square[f] = d * d;
            spread[f] = Max(center.spread[f] + Load(planes[kSbfSpread + f] + at), Fill(1.0f));
        }
        AddFractions<kSbfFeatures>(square, spread);
        e[0] = square[0] / spread[0];
        if constexpr (kKinds > 1) {
            const Floats d = Load(planes[kSbfGradient] + at) - center.feature[kSbfFeatures];
            const Floats by_gradient =
                d * d /
                Max(center.spread[kSbfFeatures] + Load(planes[kSbfGradient + 1] + at), Fill(1.0f));
            e[1] = e[0] + by_gradient;
            e[2] = e[0] + 4.0f * by_gradient;
        }
    }

    PairPlanes planes;
};

template <int kKinds>
void BankOf(const float* first_plane, const BankTables& tables, int height, float* scratch,
            float* out) {
    const PairPlanes planes = {first_plane};
    constexpr int kTotal = kKinds * kCandidates;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < kPairWidth; x += RELUME_LANES) {
            for (int k = 0; k < kTotal; ++k) {
                Store(out + SbfSum(kTotal, y, k, 0) + x, Fill(1.0f));
                for (int c = 0; c < kSbfColors; ++c) {
                    Store(out + SbfSum(kTotal, y, k, 1 + c) + x,
                          Load(planes[kSbfData + c] + y * kPairStride + x));
                }
            }
        }
    }
    const auto add = [&](const RowRings<kKinds>& rings, int y, int dy) {
        for (int kind = 0; kind < kKinds; ++kind) {
            AddRings<kSbfSums>(
                tables, rings, dy, kPairWidth,
                [&](const auto& ring, int x, Floats(&sum)[kSbfSums]) {
                    for (std::size_t n = 0; n < sizeof(ring.weight) / sizeof(ring.weight[0]); ++n) {
                        const Floats w = Load(ring.weight[n] + kind * PairRow<kKinds>::kStride + x);
                        const std::ptrdiff_t at = y * kPairStride + x + ring.offset[n];
                        sum[0] += w;
                        for (int c = 0; c < kSbfColors; ++c) {
                            sum[1 + c] += w * Load(planes[kSbfData + c] + at);
                        }
                    }
                },
                [&](int k, int s) { return out + SbfSum(kTotal, y, kind * kCandidates + k, s); });
        }
    };
    ForEachRow(SbfPair<kKinds>{planes}, tables.radius[kCandidates - 1],
               tables.spatial[kCandidates - 1], kPairWidth, height, scratch, add);
}

void SbfBank(const float* planes, const BankTables& tables, int candidates, int height,
             float* scratch, float* out) {
    (candidates == kCandidates ? BankOf<1> : BankOf<kSbfGradientKinds>)(planes, tables, height,
                                                                        scratch, out);
}

void SbfSmooth(const float* first_plane, const BankTables& tables, int k, int groups, int height,
               float* scratch, float* out) {
    const PairPlanes planes = {first_plane};
    const int count = groups * kSbfGroup;
    for (int y = 0; y < height; ++y) {
        for (int s = 0; s < count; ++s) {
            for (int x = 0; x < kPairWidth; x += RELUME_LANES) {
                Store(out + (y * count + s) * kPairWidth + x,
                      Load(planes[kSbfData + s] + y * kPairStride + x));
            }
        }
    }
    const int radius = tables.radius[k];
    const auto add = [&](const RowRings<1>& rings, int y, int dy) {
        for (int first = 0; first < count; first += kSbfGroup) {
            float* to = out + (y * count + first) * kPairWidth;
            for (int x = 0; x < kPairWidth; x += RELUME_LANES) {
                Floats sum[kSbfGroup];
                for (int s = 0; s < kSbfGroup; ++s) {
                    sum[s] = Load(to + s * kPairWidth + x);
                }
                for (int dx = dy == 0 ? 1 : 0; dx <= radius; ++dx) {
                    const float spatial = tables.spatial[k][dy][dx];
                    rings.At(dx, [&](const auto& ring) {
                        for (std::size_t n = 0; n < sizeof(ring.weight) / sizeof(ring.weight[0]);
                             ++n) {
                            const Floats w = Load(ring.weight[n] + x) * spatial;
                            const std::ptrdiff_t at = y * kPairStride + x + ring.offset[n];
                            for (int s = 0; s < kSbfGroup; ++s) {
                                sum[s] += w * Load(planes[kSbfData + first + s] + at);
                            }
                        }
                    });
                }
                for (int s = 0; s < kSbfGroup; ++s) {
                    Store(to + s * kPairWidth + x, sum[s]);
                }
            }
        }
    };
    ForEachRow(SbfPair<1>{planes}, radius, tables.spatial[k], kPairWidth, height, scratch, add);
}

}  // namespace
}  // namespace relume::denoise
