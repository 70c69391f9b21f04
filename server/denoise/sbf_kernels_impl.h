// Body of the kernels of SBF, included by one source per instruction set with RELUME_LANES (floats
// a vector) defined.
#include "server/denoise/lanes_impl.h"
#include "server/denoise/pair_rows_impl.h"
#include "server/denoise/sbf_kernels.h"

namespace relume::denoise {
namespace {

static_assert(kTileWidth % RELUME_LANES == 0);



template <int kFeatures>
struct SbfCenter {
    Floats feature[kFeatures], spread[kFeatures];
};

template <int kFeatures>
inline SbfCenter<kFeatures> LoadSbfCenter(const float* const* planes, std::ptrdiff_t at) {
    SbfCenter<kFeatures> center;
    for (int f = 0; f < kFeatures; ++f) {
        center.feature[f] = Load(planes[kSbfFeature + f] + at);
        center.spread[f] = Load(planes[kSbfSpread + f] + at);
    }
    return center;
}

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

// exp(-sum over features of d^2 / max(spread_i + spread_j, 1)), with one division.
template <int kFeatures>
inline Floats SbfWeight(const float* const* planes, std::ptrdiff_t at,
                        const SbfCenter<kFeatures>& center) {
    Floats square[kFeatures], spread[kFeatures];
    for (int f = 0; f < kFeatures; ++f) {
        const Floats d = Load(planes[kSbfFeature + f] + at) - center.feature[f];
        square[f] = d * d;
        spread[f] = Max(center.spread[f] + Load(planes[kSbfSpread + f] + at), Fill(1.0f));
    }
    AddFractions<kFeatures>(square, spread);
    return ExpOfMinus(square[0] / spread[0], kLargestExponent);
}

// Calls add(offset of a neighbour) for the up to four at (+-dx, +-dy).
template <typename Fn>
inline void ForRing(std::ptrdiff_t stride, int dx, int dy, const Fn& add) {
    const std::ptrdiff_t below = dy * stride, above = -below;
    add(below + dx);
    if (dx != 0) {
        add(below - dx);
    }
    if (dy != 0) {
        add(above + dx);
        if (dx != 0) {
            add(above - dx);
        }
    }
}

template <int kFeatures>
void BankOf(const float* const* planes, std::ptrdiff_t stride, const SbfTables& tables, int height,
            float* out) {
    constexpr int kSums = 1 + kSbfColors;
    const int radius = tables.radius[kCandidates - 1];
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < kTileWidth; x += RELUME_LANES) {
            const std::ptrdiff_t at = y * stride + x;
            const SbfCenter<kFeatures> center = LoadSbfCenter<kFeatures>(planes, at);
            Floats total[kCandidates][kSums];
            for (auto& sum : total) {
                sum[0] = Fill(1.0f);
                for (int c = 0; c < kSbfColors; ++c) {
                    sum[1 + c] = Load(planes[kSbfData + c] + at);
                }
            }
            // The neighbours at one distance are summed once, for all the candidates whose window
            // reaches so far.
            for (int dy = 0; dy <= radius; ++dy) {
                for (int dx = dy == 0 ? 1 : 0; dx <= radius; ++dx) {
                    Floats ring[kSums]{};
                    ForRing(stride, dx, dy, [&](std::ptrdiff_t offset) {
                        const Floats w = SbfWeight<kFeatures>(planes, at + offset, center);
                        ring[0] += w;
                        for (int c = 0; c < kSbfColors; ++c) {
                            ring[1 + c] += w * Load(planes[kSbfData + c] + at + offset);
                        }
                    });
                    const int reach = dx > dy ? dx : dy;
                    for (int k = kCandidates - 1; k >= 0 && tables.radius[k] >= reach; --k) {
                        const float spatial = tables.spatial[k][dy][dx];
                        for (int s = 0; s < kSums; ++s) {
                            total[k][s] += ring[s] * spatial;
                        }
                    }
                }
            }
            float* to = out + y * kTileWidth + x;
            for (int k = 0; k < kCandidates; ++k) {
                for (int s = 0; s < kSums; ++s) {
                    Store(to + (kSums * k + s) * kTileArea, total[k][s]);
                }
            }
        }
    }
}

template <int kFeatures>
void SmoothOf(const float* const* planes, std::ptrdiff_t stride, const SbfTables& tables,
              int height, float* out) {
    const int radius = tables.radius[0];
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < kTileWidth; x += RELUME_LANES) {
            const std::ptrdiff_t at = y * stride + x;
            const SbfCenter<kFeatures> center = LoadSbfCenter<kFeatures>(planes, at);
            Floats weight = Fill(1.0f), sum[kSbfSmoothed];
            for (int s = 0; s < kSbfSmoothed; ++s) {
                sum[s] = Load(planes[kSbfData + s] + at);
            }
            for (int dy = 0; dy <= radius; ++dy) {
                for (int dx = dy == 0 ? 1 : 0; dx <= radius; ++dx) {
                    const float spatial = tables.spatial[0][dy][dx];
                    ForRing(stride, dx, dy, [&](std::ptrdiff_t offset) {
                        const Floats w =
                            SbfWeight<kFeatures>(planes, at + offset, center) * spatial;
                        weight += w;
                        for (int s = 0; s < kSbfSmoothed; ++s) {
                            sum[s] += w * Load(planes[kSbfData + s] + at + offset);
                        }
                    });
                }
            }
            for (int s = 0; s < kSbfSmoothed; ++s) {
                Store(out + s * kTileArea + y * kTileWidth + x, sum[s] / weight);
            }
        }
    }
}

void SbfBank(const float* const* planes, std::ptrdiff_t stride, const SbfTables& tables, int height,
             float* out) {
    (tables.features == kSbfFeatures
         ? BankOf<kSbfFeatures>
         : BankOf<kSbfFeatures - 1>)(planes, stride, tables, height, out);
}

void SbfSmooth(const float* const* planes, std::ptrdiff_t stride, const SbfTables& tables,
               int height, float* out) {
    (tables.features == kSbfFeatures
         ? SmoothOf<kSbfFeatures>
         : SmoothOf<kSbfFeatures - 1>)(planes, stride, tables, height, out);
}

}  // namespace
}  // namespace relume::denoise
