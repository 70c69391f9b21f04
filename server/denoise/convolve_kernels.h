#pragma once

#include <cstddef>

namespace relume::denoise {

// to[x] = sum over k in [0, count) of taps[k] x from[k x step + x] for x in [0, width), from the
// first tap on: along a row with step 1, along columns with a row's length. Compiled once for each
// instruction set, with the same bits.
using ConvolveKernel = void (*)(const float* from, std::ptrdiff_t step, const float* taps,
                                int count, int width, float* to);

extern const ConvolveKernel kConvolveBaseline;
#if RELUME_WIDE_KERNELS
extern const ConvolveKernel kConvolveAvx2, kConvolveAvx512;
#endif

// The widest that this processor has, and all that it has, baseline first.
ConvolveKernel BestConvolve();
struct ConvolveList {
    ConvolveKernel list[3];
    int size;
};
ConvolveList UsableConvolves();

}  // namespace relume::denoise
