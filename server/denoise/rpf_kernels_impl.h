// Bodies of the kernels, included by one source per instruction set with RELUME_LANES (floats a
// vector) defined.
#include "server/denoise/lanes_impl.h"
#include "server/denoise/rpf_kernels.h"

namespace relume::denoise {
namespace {

constexpr int kRpfVectors = kRpfBlock / RELUME_LANES;  // a block

void Alike(const float* const* rows, int count, const float* mean, const float* reach,
           std::uint8_t* out) {
    for (int j = 0; j < count; ++j) {
        Floats least = Fill(0);
        for (int v = 0; v < kRpfBlock; v += RELUME_LANES) {
            const Floats d = Load(rows[j] + v) - Load(mean + v);
            least = Min(Load(reach + v) - Max(d, -d), least);
        }
        out[j] = AnyBelow(least, 0) ? 0 : 1;
    }
}

void Sum(const float* values, int count, float base, float* sums) {
    Floats sum[kRpfVectors]{};
    for (int j = 0; j < count; j += kRpfBlock) {
        for (int v = 0; v < kRpfVectors; ++v) {
            sum[v] += Load(values + j + v * RELUME_LANES) - base;
        }
    }
    for (int v = 0; v < kRpfVectors; ++v) {
        Store(sums + v * RELUME_LANES, sum[v]);
    }
}

void SumSquares(const float* values, int count, float base, float* sums) {
    Floats sum[kRpfVectors]{};
    for (int j = 0; j < count; j += kRpfBlock) {
        for (int v = 0; v < kRpfVectors; ++v) {
            const Floats d = Load(values + j + v * RELUME_LANES) - base;
            sum[v] += d * d;
        }
    }
    for (int v = 0; v < kRpfVectors; ++v) {
        Store(sums + v * RELUME_LANES, sum[v]);
    }
}

void Normalise(float* values, int count, float mean, float scale, std::uint8_t* bins) {
    for (int j = 0; j < count; ++j) {
        const float value = (values[j] - mean) * scale;
        values[j] = value;
        const float above = value > -5.0f ? value : -5.0f;
        bins[j] = static_cast<std::uint8_t>(static_cast<int>((above < 4.0f ? above : 4.0f) + 5.5f));
    }
}

inline std::uint64_t MaskOf(const std::uint8_t* bins, int bin) {
#if RELUME_LANES == 16
    return _mm512_cmpeq_epi8_mask(_mm512_loadu_si512(bins),
                                  _mm512_set1_epi8(static_cast<char>(bin)));
#elif defined(__SSE2__)
    std::uint64_t mask = 0;
    for (int k = 0; k < kRpfWord; k += 16) {
        const __m128i equal =
            _mm_cmpeq_epi8(_mm_loadu_si128(reinterpret_cast<const __m128i*>(bins + k)),
                           _mm_set1_epi8(static_cast<char>(bin)));
        mask |= static_cast<std::uint64_t>(_mm_movemask_epi8(equal)) << k;
    }
    return mask;
#else
    std::uint64_t mask = 0;
    for (int k = 0; k < kRpfWord; ++k) {
        mask |= static_cast<std::uint64_t>(bins[k] == bin) << k;
    }
    return mask;
#endif
}

inline std::uint64_t CountBits(std::uint64_t x) {
#if defined(__POPCNT__)
    return static_cast<std::uint64_t>(__builtin_popcountll(x));
#else
    // Pairs of bits, then nibbles, then bytes.
    x -= (x >> 1) & 0x5555555555555555u;
    x = (x & 0x3333333333333333u) + ((x >> 2) & 0x3333333333333333u);
    x = (x + (x >> 4)) & 0x0f0f0f0f0f0f0f0fu;
    x += x >> 8;
    x += x >> 16;
    return (x + (x >> 32)) & 0x7f;
#endif
}

void MakeMasks(const std::uint8_t* bins, int words, std::uint64_t* masks, std::uint32_t* counts) {
    for (int bin = 0; bin < kRpfBins; ++bin) {
        std::uint64_t count = 0;
        for (int k = 0; k < words; ++k) {
            const std::uint64_t mask = MaskOf(bins + k * kRpfWord, bin);
            masks[bin * words + k] = mask;
            count += CountBits(mask);
        }
        counts[bin] = static_cast<std::uint32_t>(count);
    }
}

void CountBoth(const std::uint64_t* const* a, int na, const std::uint64_t* const* b, int nb,
               int words, std::uint32_t* out) {
    for (int i = 0; i < na; ++i) {
        for (int j = 0; j < nb; ++j) {
            const std::uint64_t *p = a[i], *q = b[j];
            std::uint64_t count = 0;
            for (int k = 0; k < words; ++k) {
                count += CountBits(p[k] & q[k]);
            }
            out[i * nb + j] = static_cast<std::uint32_t>(count);
        }
    }
}

void Weigh(const RpfColumns& columns, int own, float* sums) {
    constexpr float kCut = 17;
    Floats weights[kRpfVectors]{}, colors[3][kRpfVectors]{};
    for (int j = 0; j < columns.count; j += kRpfBlock) {
        Floats exponent[kRpfVectors];
        for (int v = 0; v < kRpfVectors; ++v) {
            exponent[v] = Load(columns.outside + j + v * RELUME_LANES);
        }
        for (int k = 0; k < columns.compared_count; ++k) {
            const float* column = columns.compared[k];
            const float center = column[own], coefficient = columns.coefficients[k];
            for (int v = 0; v < kRpfVectors; ++v) {
                const Floats d = Load(column + j + v * RELUME_LANES) - center;
                exponent[v] += coefficient * (d * d);
            }
        }
        for (int v = 0; v < kRpfVectors; ++v) {
            const Floats weight = ExpOfMinus(exponent[v], kCut);
            weights[v] += weight;
            for (int c = 0; c < 3; ++c) {
                colors[c][v] += weight * Load(columns.color[c] + j + v * RELUME_LANES);
            }
        }
    }
    for (int v = 0; v < kRpfVectors; ++v) {
        Store(sums + v * RELUME_LANES, weights[v]);
        for (int c = 0; c < 3; ++c) {
            Store(sums + (c + 1) * kRpfBlock + v * RELUME_LANES, colors[c][v]);
        }
    }
}

}  // namespace
}  // namespace relume::denoise
