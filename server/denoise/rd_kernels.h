#pragma once

#include <cstddef>

#include "server/denoise/nlm_kernels.h"

namespace relume::denoise {

// The inner loops of robust denoising that non-local means lack: plain functions of arrays,
// compiled once for each instruction set, which give the same bits. Rows may be read and written up
// to kNlmLanes - 1 floats beyond their width.

inline constexpr int kRdChannels = 8;  // of features, at most
inline constexpr int kRdGroups = 4;
inline constexpr int kRdFloors = 2;  // of spreads, at most

// Features at a tile's first pixel: groups of 1 or 3 channels, one after another.
struct RdFeatures {
    const float* value[kRdChannels];
    const float* variance[kRdChannels];
    const float* spread[kRdChannels];  // max(variance, squared gradient)
    int groups;
    int size[kRdGroups];  // 1 or 3
    std::ptrdiff_t stride, shift;
    float k_squared, epsilon;
    int floors;
    float tau[kRdFloors];  // distances are computed for each
    float* distance[kRdFloors][kNlmDirections];
    std::ptrdiff_t distance_stride;
};

// Sums over the neighbours of a tile's pixels, planes of `stride`.
inline constexpr int kRdInputs = 6;  // three colours, and three more
struct RdSums {
    float* weight;
    float* largest;  // weight
    float* squares;  // of weights; null: not wanted
    float* sum[kRdInputs];
    // The same with the pixel's own colour nudged; the three colours alone. Null: not wanted.
    float* nudged_weight;
    float* nudged_largest;
    float* nudged_sum[3];
    std::ptrdiff_t stride;
};

// One offset and its opposite: distances of colour (null: none) and of features, what is summed at
// the tile's first pixel. All distances must have kBetween.
struct RdPair {
    const float* color[kNlmDirections];
    const float* nudged[kNlmDirections];
    std::ptrdiff_t color_stride;
    const float* feature[kNlmDirections];
    std::ptrdiff_t feature_stride;
    const float* in[kRdInputs];
    int inputs;  // 3 or 6
    std::ptrdiff_t in_stride, shift;
};

struct RdKernels {
    const char* name;
    // The largest distance of any group of features, at least 0: mean over channels of
    // ((f_i - f_j)^2 - v_i - min(v_i, v_j)) / (epsilon + k^2 (d_i + d_j)), d = max(spread, tau).
    void (*features)(const RdFeatures& features, int width, int height);
    // Adds both neighbours by weights exp(-max(0, largest distance)), with the pairwise symmetric
    // trick where both distances are below 25.
    void (*gather)(const RdPair& pair, const RdSums& sums, int width, int height);
};

// Lane widths of 4, 8 and 16 floats. Those that this processor lacks must not be called.
extern const RdKernels kRdBaselineKernels;
#if RELUME_WIDE_KERNELS
extern const RdKernels kRdAvx2Kernels, kRdAvx512Kernels;
#endif

// Those of the same instruction set.
const RdKernels& RdKernelsFor(const NlmKernels& kernels);

}  // namespace relume::denoise
