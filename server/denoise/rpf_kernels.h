#pragma once

namespace relume::denoise {

inline constexpr int kRpfBlock = 16;  // samples; lengths are padded to multiples of it

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

// The sums over all samples of w and of w times each colour, w = exp(-exponent) against sample
// `own`: sums[4 x kRpfBlock], partial ones to be added up in order. Compiled once for each
// instruction set, with the same bits.
using RpfKernel = void (*)(const RpfColumns& columns, int own, float* sums);

extern const RpfKernel kRpfBaseline;
#if RELUME_WIDE_KERNELS
extern const RpfKernel kRpfAvx2, kRpfAvx512;
#endif

// The widest that this processor has, and all that it has, baseline first.
RpfKernel BestRpf();
struct RpfList {
    RpfKernel list[3];
    int size;
};
RpfList UsableRpfs();

}  // namespace relume::denoise
