#pragma once

#include <cstdint>

namespace relume::denoise {

// The inner loops of RPF: plain functions of arrays, compiled once for each instruction set, with
// the same bits.

inline constexpr int kRpfBlock = 16;  // floats; columns are padded to multiples of it
inline constexpr int kRpfBins = 10;   // of rounded values
inline constexpr int kRpfWord = 64;   // rounded values in a word of masks

// Samples in columns of `count` floats, a multiple of kRpfBlock, aligned or not.
struct RpfColumns {
    int count = 0;
    const float* outside;  // 0, or at least 1e3 for samples that only pad the columns
    // What samples are compared by: exponent += coefficient (value - own value)^2.
    const float* const* compared;
    const float* coefficients;
    int compared_count = 0;
    const float* color[3];
};

struct RpfKernels {
    // Of `count` rows of floats, whether each one's first kRpfBlock are within `reach` of `mean`:
    // 1 or 0.
    void (*alike)(const float* const* rows, int count, const float* mean, const float* reach,
                  std::uint8_t* out);
    // Of a column, a multiple of kRpfBlock: sums of value - base, or of its square, kRpfBlock
    // partial ones to be added up in order.
    void (*sum)(const float* values, int count, float base, float* sums);
    void (*sum_squares)(const float* values, int count, float base, float* sums);
    // Replaces values by scale (value - mean), and rounds those: to 0 for -5 and less up to 9 for 4
    // and more.
    void (*normalise)(float* values, int count, float mean, float scale, std::uint8_t* bins);
    // masks[bin * words + k]: bit j is set if bins[kRpfWord k + j] is that bin; how many are, a
    // bin.
    void (*make_masks)(const std::uint8_t* bins, int words, std::uint64_t* masks,
                       std::uint32_t* counts);
    // out[i * nb + j]: bits that are set in both masks, a[i] and b[j].
    void (*count_both)(const std::uint64_t* const* a, int na, const std::uint64_t* const* b, int nb,
                       int words, std::uint32_t* out);
    // The sums over all samples of w and of w times each colour, w = exp(-exponent) against sample
    // `own`: sums[4 x kRpfBlock], partial ones to be added up in order.
    void (*weigh)(const RpfColumns& columns, int own, float* sums);
};

extern const RpfKernels kRpfBaseline;
#if RELUME_WIDE_KERNELS
extern const RpfKernels kRpfAvx2, kRpfAvx512;
#endif

// The widest that this processor has, and all that it has, baseline first.
const RpfKernels& BestRpf();
struct RpfList {
    const RpfKernels* list[3];
    int size;
};
RpfList UsableRpfs();

}  // namespace relume::denoise
