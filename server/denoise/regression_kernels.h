#pragma once

#include <cstddef>

namespace relume::denoise {

// The inner loops of first-order regression: plain functions of arrays, compiled once for each
// instruction set, which give the same bits.

inline constexpr int kRegressionRadius = 9;  // pixels
inline constexpr int kRegressionSide = 2 * kRegressionRadius + 1;
inline constexpr int kRegressionWindow = kRegressionSide * kRegressionSide;
inline constexpr int kRegressionTileWidth = 64, kRegressionTileHeight = 32;  // pixels
inline constexpr int kRegressionGroup = 16;  // adjacent pixels whose weights lie side by side
inline constexpr int kMaxRegressionFeatures = 8;

// One tile. Planes point at its first pixel and have a halo of kRegressionRadius pixels on all
// sides.
struct RegressionTile {
    int width, height;  // pixels
    int features;       // 0 to kMaxRegressionFeatures
    const float* feature[kMaxRegressionFeatures];
    const float* color[3];
    std::ptrdiff_t stride;  // of both
    // The weight of the neighbour of pixel (x, y) at (dx, dy) is element
    // WeightIndex(x, y, dx, dy); 0 outside of the image. Pixels of the tile outside of the image
    // have weights 0.
    const float* weights;
    // The normal matrix of centred columns gets `ridge` of each column's own variance more on its
    // diagonal, and `floor`: variance below which a feature is taken for constant.
    float ridge, floor;
    // Where fits are added, with the same halo: the weighted sum of the predictions of every pixel
    // in whose window this one lies, a channel, and that of the weights.
    float* sum[4];
    std::ptrdiff_t sum_stride;
};

inline constexpr std::ptrdiff_t kRegressionWeights =
    std::ptrdiff_t{kRegressionWindow} * kRegressionTileWidth * kRegressionTileHeight;

constexpr std::ptrdiff_t WeightIndex(int x, int y, int dx, int dy) {
    const int group = y * (kRegressionTileWidth / kRegressionGroup) + x / kRegressionGroup;
    const int offset = (dy + kRegressionRadius) * kRegressionSide + dx + kRegressionRadius;
    return (std::ptrdiff_t{group} * kRegressionWindow + offset) * kRegressionGroup +
           x % kRegressionGroup;
}

struct RegressionKernels {
    const char* name;
    // Fits color = a + b dx + c dy + sum over features of e_f (f_j - f_i) to each pixel's window by
    // weighted least squares, and adds the fit's values at all pixels of the window, times their
    // weights, to tile.sum: collaborative regression (Bitterli et al. 2016, section 3).
    void (*regress)(const RegressionTile& tile);
    // Weights become their fourth power: those of distances over half the k.
    void (*sharpen)(float* weights, std::ptrdiff_t count);
};

// Lane widths of 4, 8 and 16 floats. Those that this processor lacks must not be called.
extern const RegressionKernels kRegressionBaselineKernels;
#if RELUME_WIDE_KERNELS
extern const RegressionKernels kRegressionAvx2Kernels, kRegressionAvx512Kernels;
#endif

// The widest that this processor has.
const RegressionKernels& BestRegressionKernels();
// All that this processor has, baseline first.
struct RegressionKernelList {
    const RegressionKernels* list[3];
    int size;
};
RegressionKernelList UsableRegressionKernels();

}  // namespace relume::denoise
