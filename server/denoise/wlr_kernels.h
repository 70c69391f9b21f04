#pragma once

#include <cstddef>

namespace relume::denoise {

// The inner loops of weighted local regression: plain functions of arrays, compiled once for each
// instruction set, which give the same bits.

inline constexpr int kWlrRadius = 9;                  // the widest window, pixels
inline constexpr int kWlrFeatures = 7;                // depth, normal, albedo
inline constexpr int kWlrColumns = 2 + kWlrFeatures;  // x and y first
inline constexpr int kWlrTrials = 5;                  // bandwidths 0.2, 0.4, ... 1

// Planes of a tile, with a halo as wide as the window, 0 outside of the image.
enum WlrPlane {
    kWlrColor,
    kWlrFeature = 3,
    kWlrNoise = kWlrFeature + kWlrFeatures,  // variance of the mean, summed over the channels of
                                             // depth, normal, albedo
    kWlrGrey = kWlrNoise + 3,
    kWlrVariance,   // of the grey mean
    kWlrDeviation,  // its root
    kWlrTrust,      // weight of a pixel whatever its neighbours: 1 / max(variance, 1)
    kWlrPlanes,
};

// One pixel's fit.
enum WlrFitPlane {
    kWlrValue,            // filtered colour
    kWlrFitVariance = 3,  // of it, grey
    kWlrFitPlanes,
};

struct WlrTile {
    const float* const* planes;  // WlrPlane, each at the tile's first pixel
    std::ptrdiff_t stride;
    int height;      // rows; all kTileWidth columns are computed
    int radius;      // of the window, at most kWlrRadius
    float* scratch;  // kWlrScratch floats, at an address that 64 divides
};

inline constexpr std::ptrdiff_t kWlrScratch =
    std::ptrdiff_t{16} * (2 * kWlrRadius + 1) * (2 * kWlrRadius + 1) * (kWlrColumns + 6);

struct WlrKernels {
    const char* name;
    // out[(kWlrFitPlanes t + p) * kTileArea + y * kTileWidth + x] is plane p of the fit with the
    // t-th bandwidth, and plane kWlrFitPlanes * kWlrTrials the number of dimensions.
    void (*try_bandwidths)(const WlrTile& tile, float* out);
    // The same with each pixel's own bandwidth, at y * kTileWidth + x; the four planes of one fit.
    void (*fit)(const WlrTile& tile, const float* bandwidth, float* out);
};

// Lane widths of 4, 8 and 16 floats. Those that this processor lacks must not be called.
extern const WlrKernels kWlrBaselineKernels;
#if RELUME_WIDE_KERNELS
extern const WlrKernels kWlrAvx2Kernels, kWlrAvx512Kernels;
#endif

// The widest that this processor has.
const WlrKernels& BestWlrKernels();
// All that this processor has, baseline first.
struct WlrKernelList {
    const WlrKernels* list[3];
    int size;
};
WlrKernelList UsableWlrKernels();

}  // namespace relume::denoise
