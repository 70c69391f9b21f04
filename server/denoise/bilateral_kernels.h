#pragma once

#include <cstddef>

namespace relume::denoise {

// The inner loops of the bilateral filter: plain functions of arrays, compiled once for each
// instruction set. All versions do the same operations in the same order on each pixel, so they
// give the same bits.

inline constexpr int kTileWidth = 64, kTileHeight = 32;  // pixels
inline constexpr int kTileArea = kTileWidth * kTileHeight;

// Candidates of the corrected filter: sigma_s = 1, sqrt(2), 2, ..., 8 pixels.
inline constexpr int kCandidates = 7;
inline constexpr int kBankRadius = 16;  // widest window, pixels

// Planes of a tile with a halo of kBankRadius (bank) or kPrintedRadius (printed) pixels on all
// sides. Pixels outside the image have depth kOutside, which takes their weight to 0.
inline constexpr float kOutside = 1e10f;

enum BankPlane {
    kBankColor,
    kBankNormal = 3,
    kBankAlbedo = 6,
    kBankDepth = 9,
    kBankSpread,
    kBankPlanes = 13,
    kBankNoise = kBankPlanes,  // of the guide kernel alone
    kGuidePlanes = 16,
    kRobustGuide = kBankPlanes,  // of the robust kernel alone
    kRobustNoise = 16,
    kRobustShare = 19,
    kRobustPlanes = 20,
};

// Tiles of the bank's kernel, which weighs each pair of pixels once: larger, since that pays inside
// of a tile alone.
inline constexpr int kPairWidth = 128, kPairHeight = 64;  // pixels
// From row to row and from plane to plane, floats. Planes a multiple of 4096 bytes apart would
// share few places of the processor's cache: they lie some lines beyond.
inline constexpr std::ptrdiff_t PlaneStride(int width, int halo) { return width + 2 * halo; }
inline constexpr std::ptrdiff_t PlaneSize(int width, int height, int halo) {
    return (PlaneStride(width, halo) * (height + 2 * halo) + 1023) / 1024 * 1024 + 5 * 16;
}
inline constexpr std::ptrdiff_t kPairStride = PlaneStride(kPairWidth, kBankRadius);
inline constexpr std::ptrdiff_t kPairPlane = PlaneSize(kPairWidth, kPairHeight, kBankRadius);
// Floats that it works in, for each kind of weight.
inline constexpr int kPairScratch =
    2 * static_cast<int>(kPairStride) * (kBankRadius + 1) * (kBankRadius + 1);

struct BankTables {
    int radius[kCandidates];  // rising, pixels
    float spatial[kCandidates][kBankRadius + 1]
                 [kBankRadius +
                  1];  // exp(-d^2/(2 sigma_s^2)) at [|dy|][|dx|]; 0 in the last: left out
    float floor[3];    // of a pair's spread: normal, albedo, depth
};

// For `height` rows of `width` pixels, at most a tile's: BankSum(y, k, 0) + x of `out` is the sum
// of candidate k's weights, 1 for the pixel itself, s = 1..3 the weighted sums of colour. planes[p]
// points at the tile's first pixel; kBankSpread + 0..2 hold the group's sample variance times 2
// sigma_k^2. `scratch`: kPairScratch floats.
inline constexpr int kBankSums = 4;
inline constexpr int BankSum(int y, int k, int s) {
    return ((y * kCandidates + k) * kBankSums + s) * kPairWidth;
}
using BankKernel = void (*)(const float* planes, const BankTables& tables, int width, int height,
                            float* scratch, float* out);

// A filter of candidate 0's window and weights, for the robust filter to compare colours by, with
// its variance. out[s * kTileArea + y * kTileWidth + x]: the sum of weights, 1 for the pixel
// itself; + 1..3 the weighted sums of colour; + 4..6 the sums of kBankNoise + 0..2, the variance of
// the mean, by squared weights.
inline constexpr int kGuideSums = 7;
using GuideKernel = void (*)(const float* const* planes, std::ptrdiff_t stride,
                             const BankTables& tables, int height, float* out);

// Sums of the robust filter over a window without the pixel itself: of w, a pair's weight by
// features, and w u, u = y_j - y_i in colour; then of w' = w times the range factor, w' u; and the
// two that make the derivative of the filtered pixel by the noisy one, of t and t u: t = w' r g
// (1 - s) where the range factor is below 1, else 0; g = guide_j - guide_i, r = 1/(2 kappa^2 (v_i +
// v_j) + floor), v the guide's variance, s the noisy pixel's share in guide_j over its share in
// guide_i.
enum RobustSumPlane {
    kRobustWeight,
    kRobustDelta,
    kRangeWeight = 4,
    kRangeDelta,
    kRangeSlope = 8,
    kRangeCurve = 11,
    kRobustSums = 14,
};

inline constexpr float kRangeScale = 3;  // 2 kappa^2, kappa = 1.22
inline constexpr float kRangeFloor = 1e-10f;

// RobustSum(y, k, s) + x of `out` is candidate k's sum s. Tiles and `scratch` as for the bank, the
// latter 2 kPairScratch + kRobustScratch floats. kRobustGuide + 0..2 hold the guide, kRobustNoise +
// 0..2 its variance, kRobustShare a pixel's own share in it.
inline constexpr int RobustSum(int y, int k, int s) {
    return ((y * kCandidates + k) * kRobustSums + s) * kPairWidth;
}
inline constexpr int kRobustScratch = 4 * 5 * kPairWidth;
using RobustKernel = BankKernel;

inline constexpr int kPrintedRadius = 8;

enum PrintedPlane {
    kPrintedColor,  // all samples, then half a, then half b
    kPrintedNormal = 9,
    kPrintedAlbedo = 12,
    kPrintedDepth = 15,
    kPrintedVariance,  // a sample's, summed over the group: normal, albedo, depth
    kPrintedGradient = 19,
    kPrintedPlanes,
};

struct PrintedTables {
    float sigma_s;  // grey-level gradient, as (14) has it
    int taylor;     // terms after the first; 0 = direct exp
    float inverse_distance[kPrintedRadius + 1]
                          [kPrintedRadius + 1];  // 1/|s_j - s_i| at [|dy|][|dx|]
    float range_scale;                           // 1/(2 sigma_r^2)
    float feature_scale[3];                      // 1/(2 sigma_fk^2)
};

// out[c * kTileArea + y * kTileWidth + x] is the filtered colour: all samples, half a, half b.
using PrintedKernel = void (*)(const float* const* planes, std::ptrdiff_t stride,
                               const PrintedTables& tables, int height, float* out);

struct BilateralKernels {
    const char* name;
    BankKernel bank;
    GuideKernel guide;
    RobustKernel robust;
    PrintedKernel printed;
};

// Lane widths of 4, 8 and 16 floats. Those that this processor lacks must not be called.
extern const BilateralKernels kBaselineKernels;
#if RELUME_WIDE_KERNELS
extern const BilateralKernels kAvx2Kernels, kAvx512Kernels;
#endif

// The widest that this processor has.
const BilateralKernels& BestKernels();
// All that this processor has, baseline first.
struct KernelList {
    const BilateralKernels* list[3];
    int size;
};
KernelList UsableKernels();

}  // namespace relume::denoise
