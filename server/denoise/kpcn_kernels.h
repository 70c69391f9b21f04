#pragma once

#include <cstddef>

namespace relume::denoise {

// Applies predicted kernels to kKpcnBlock pixels of a row: each is the mean of its window of
// (2 radius + 1)^2 pixels by the weights exp(logit). Compiled once for each instruction set, with
// the same bits.
//
// The logits of the window's pixels, row by row from the upper left, lie `logit_step` floats apart;
// those of the block's pixels one after another. `image`: R, G, B at the block's first pixel, rows
// `stride` floats apart, with `radius` pixels on all sides. out[s * kKpcnBlock + x]: R, G, B, and
// the pixel's own share in its mean.
inline constexpr int kKpcnBlock = 16;
inline constexpr int kKpcnOutputs = 4;
using KpcnKernel = void (*)(const float* logits, std::ptrdiff_t logit_step,
                            const float* const* image, std::ptrdiff_t stride, int radius,
                            float* out);

extern const KpcnKernel kKpcnBaseline;
#if RELUME_WIDE_KERNELS
extern const KpcnKernel kKpcnAvx2, kKpcnAvx512;
#endif

// The widest that this processor has, and all that it has, baseline first.
KpcnKernel BestKpcn();
struct KpcnList {
    KpcnKernel list[3];
    int size;
};
KpcnList UsableKpcn();

}  // namespace relume::denoise
