#pragma once

#include <cstddef>

#include "server/denoise/bilateral_kernels.h"

namespace relume::denoise {

// The inner loops of SBF: plain functions of arrays, compiled once for each instruction set, with
// the same bits. Tiles are kPairTile's (bilateral_tiles.h).

// Features in units in which a pair's spread is at least 1: normal XYZ, albedo RGB, depth; each
// one's spread; then the gradient and its spread, for sbf-gradient alone; then what is averaged.
// Pixels outside the image have depth kOutside.
inline constexpr int kSbfFeatures = 7;
enum SbfPlane {
    kSbfFeature,
    kSbfSpread = kSbfFeatures,
    kSbfGradient = 2 * kSbfFeatures,
    kSbfData = kSbfGradient + 2,
};
inline constexpr int kSbfColors = 3;  // data planes of the bank
inline constexpr int kSbfGroup = 8;   // the smoothing kernel's come in groups of so many

// Features and spreads are at most this, so that their products stay in range.
inline constexpr float kSbfLargest = 4e3f;

// How weights see the gradient: not at all; by a kernel of sigma_g = 1, in whose units it is; of
// 1/2. The bank has kCandidates windows for each.
inline constexpr int kSbfGradientKinds = 3;

// SbfSum(candidates, y, k, s) + x of `out`: of candidate k (window k % kCandidates, kind k /
// kCandidates) the sum of weights, 1 for the pixel itself, and for s = 1..3 the weighted sums of
// colour. candidates: kCandidates, or kSbfGradientKinds times as many. `scratch`: kPairScratch
// floats for each kind. Tables: radius and spatial alone are read.
inline constexpr int kSbfSums = 1 + kSbfColors;
inline constexpr int SbfSum(int candidates, int y, int k, int s) {
    return ((y * candidates + k) * kSbfSums + s) * kPairWidth;
}
using SbfBankKernel = void (*)(const float* planes, const BankTables& tables, int candidates,
                               int height, float* scratch, float* out);

// Sums of the data planes over window k, by weights that don't see the gradient:
// out[(y * groups * kSbfGroup + s) * kPairWidth + x].
using SbfSmoothKernel = void (*)(const float* planes, const BankTables& tables, int k, int groups,
                                 int height, float* scratch, float* out);

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
