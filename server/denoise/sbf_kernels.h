#pragma once

#include <cstddef>

#include "server/denoise/bilateral_kernels.h"

namespace relume::denoise {

// The inner loops of SBF: plain functions of arrays, compiled once for each instruction set, with
// the same bits (bilateral_kernels.h). Tiles are the bilateral filter's, kTileWidth x kTileHeight.

// Features in units in which a pair's spread is at least 1: normal XYZ, albedo RGB, depth, and, for
// sbf-gradient alone, the gradient; then each one's spread; then what is averaged. Pixels outside
// the image have depth kOutside.
inline constexpr int kSbfFeatures = 8;
enum SbfPlane {
    kSbfFeature,
    kSbfSpread = kSbfFeatures,
    kSbfData = 2 * kSbfFeatures,
};
inline constexpr int kSbfColors = 3, kSbfSmoothed = 8;  // data planes of the two kernels

// Features and spreads are at most this, so that their products stay in range.
inline constexpr float kSbfLargest = 4e3f;

struct SbfTables {
    int features;  // 7 or 8: those in use
    int radius[kCandidates];
    float spatial[kCandidates][kBankRadius + 1][kBankRadius + 1];  // as in BankTables
};

// Of each candidate the sum of weights, 1 for the pixel itself, and the weighted sums of colour:
// out[(4 k + s) * kTileArea + y * kTileWidth + x].
using SbfBankKernel = void (*)(const float* const* planes, std::ptrdiff_t stride,
                               const SbfTables& tables, int height, float* out);

// Means of the kSbfSmoothed data planes by the weights of candidate 0:
// out[s * kTileArea + y * kTileWidth + x].
using SbfSmoothKernel = SbfBankKernel;

struct SbfKernels {
    const char* name;
    SbfBankKernel bank;
    SbfSmoothKernel smooth;
};

extern const SbfKernels kSbfBaselineKernels;
#if RELUME_WIDE_KERNELS
extern const SbfKernels kSbfAvx2Kernels, kSbfAvx512Kernels;
#endif

// The widest that this processor has, and all that it has, baseline first.
const SbfKernels& BestSbfKernels();
struct SbfKernelList {
    const SbfKernels* list[3];
    int size;
};
SbfKernelList UsableSbfKernels();

}  // namespace relume::denoise
