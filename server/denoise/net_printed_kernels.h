#pragma once

#include <cstddef>

namespace relume::denoise {

// The cross-bilateral filter of equations (7) to (9) of Xing, Chen, Li 2020 with parameters of each
// pixel's own. Compiled once for each instruction set, with the same bits.

inline constexpr int kNetPrintedRadius = 8;  // pixels

// Planes of a tile (bilateral_tiles.h) with a halo of kNetPrintedRadius.
enum NetPrintedPlane {
    kNetPrintedColor,
    kNetPrintedNormal = 3,
    kNetPrintedAlbedo = 6,
    kNetPrintedDepth = 9,
    kNetPrintedVariance,     // a sample's, summed over the group: normal, albedo, depth
    kNetPrintedInside = 13,  // 1 in the image, 0 beyond its border
    kNetPrintedScale,        // 1/(2 sigma^2) of space, range, normal, albedo, depth
    kNetPrintedPlanes = kNetPrintedScale + 5,
};

// out[s * kTileArea + y * kTileWidth + x]: R, G, B, then the sum of weights (1 for the pixel
// itself), then the weighted sums of (y_j - y_i)^2 of R, G, B.
inline constexpr int kNetPrintedOutputs = 7;
using NetPrintedKernel = void (*)(const float* const* planes, std::ptrdiff_t stride, int height,
                                  float* out);

extern const NetPrintedKernel kNetPrintedBaseline;
#if RELUME_WIDE_KERNELS
extern const NetPrintedKernel kNetPrintedAvx2, kNetPrintedAvx512;
#endif

// The widest that this processor has, and all that it has, baseline first.
NetPrintedKernel BestNetPrinted();
struct NetPrintedList {
    NetPrintedKernel list[3];
    int size;
};
NetPrintedList UsableNetPrinted();

}  // namespace relume::denoise
