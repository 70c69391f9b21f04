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
    kRobustVariance = kBankPlanes,
    kRobustPlanes = 16,
};

struct BankTables {
    int radius[kCandidates];  // rising, pixels
    float spatial[kCandidates][kBankRadius + 1]
                 [kBankRadius + 1];  // exp(-d^2/(2 sigma_s^2)) at [|dy|][|dx|]
    float floor[3];                  // of a pair's spread: normal, albedo, depth
};

// For `height` rows and all kTileWidth columns: out[(4 k + 0) * kTileArea + y * kTileWidth + x] is
// the sum of candidate k's weights, + 1..3 the weighted sums of colour. planes[p] points at the
// tile's first pixel; kBankSpread + 0..2 hold the group's sample variance times 2 sigma_k^2.
using BankKernel = void (*)(const float* const* planes, std::ptrdiff_t stride,
                            const BankTables& tables, int height, float* out);

// Sums of the robust filter over a window, w a pair's weight by features, u = y_j - y_i in colour:
// of w and w u; then of w' = w times the range factor, w' u, w' r u and w' r u^2, where r is
// 1/(2 kappa^2 (v_i + v_j) + floor) if the range factor is below 1, else 0. The last two make the
// derivative of the filtered pixel by the noisy one.
enum RobustSumPlane {
    kRobustWeight,
    kRobustDelta,
    kRangeWeight = 4,
    kRangeDelta,
    kRangeSlope = 8,
    kRangeCurve = 11,
    kRobustSums = 14,
};

// kappa is 2 (methods 3.7); the floor is of a squared colour difference.
inline constexpr float kRangeScale = 8, kRangeFloor = 1e-10f;

// As BankKernel: out[(kRobustSums k + s) * kTileArea + y * kTileWidth + x] is candidate k's sum s,
// without the pixel itself. kRobustVariance + 0..2 hold the colour's pooled variance of the mean.
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
