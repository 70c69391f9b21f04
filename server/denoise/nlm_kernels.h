#pragma once

#include <cstddef>

namespace relume::denoise {

// The inner loops of non-local means: plain functions of arrays, compiled once for each instruction
// set, which give the same bits. Rows may be read and written up to kNlmLanes - 1 floats beyond
// their width.
inline constexpr int kNlmLanes = 16;
inline constexpr int kNlmChannels = 3;  // of a guide, at most
inline constexpr int kNlmBoxRows = 4;   // that a box filter sums at a time

// Planes of a guide at the first pixel of a region, and what a distance is made of (NlmOptions).
struct NlmPair {
    const float* value[kNlmChannels];
    const float* variance[kNlmChannels];
    int channels;
    std::ptrdiff_t stride;  // of the guide's rows
    std::ptrdiff_t shift;   // from a pixel to its neighbour
    float alpha, k_squared, epsilon, largest;
    bool own_variance;  // NlmOptions
};

// Patch distances of a tile's pixels in all three directions, and one over the number of patch
// pixels in each: across[x] x down[y].
enum NlmDirection { kForward, kBackward, kBetween, kNlmDirections };
struct NlmNudge {
    float factor;
    bool near;            // the neighbours lie within the patch
    const float* inside;  // 1 in the image, 0 outside; as the guide's planes
    const float* across[kNlmDirections];
    const float* down[kNlmDirections];
    const float* distance[kNlmDirections];  // kBetween may be null
    float* nudged[kNlmDirections];
    std::ptrdiff_t stride;  // of distances
};

struct NlmKernels {
    const char* name;
    // Distances without patch, mean over channels, for the pixels q of a region of width x height:
    // forward[q] of q to q + shift, backward[q] of q + shift to q.
    void (*pair)(const NlmPair& pair, int width, int height, float* forward, float* backward,
                 std::ptrdiff_t stride);
    // The same of q to the mean of q + shift and q - shift.
    void (*between)(const NlmPair& pair, int width, int height, float* out, std::ptrdiff_t stride);
    // What the distances become if the pixel's own values are `factor` times what they are.
    void (*nudge)(const NlmPair& pair, const NlmNudge& nudge, int width, int height);
    // out = (sum over the (2 radius + 1)^2 window of `in`) x across[x] x down[y]. `in` points at
    // the pixel of out[0]; `rows` has kNlmBoxRows times width + 2 radius + 3 kNlmLanes floats.
    void (*box)(const float* in, std::ptrdiff_t in_stride, int radius, int width, int height,
                const float* across, const float* down, float* rows, float* out,
                std::ptrdiff_t stride);
    // exp(-max(0, distance)), in place; below exp(-40) it is 0.
    void (*weights)(float* plane, std::ptrdiff_t stride, int width, int height);
    // The pairwise symmetric trick on the weights of both directions, in place; `between` holds
    // distances.
    void (*symmetric)(float* forward, float* backward, const float* between, std::ptrdiff_t stride,
                      int width, int height);
    // Weights below `floor` become 0.
    void (*cut)(float* plane, std::ptrdiff_t stride, int width, int height, float floor);
    // sum += weight x in.
    void (*accumulate)(const float* weight, std::ptrdiff_t weight_stride, const float* in,
                       std::ptrdiff_t in_stride, int width, int height, float* sum,
                       std::ptrdiff_t sum_stride);
};

// Lane widths of 4, 8 and 16 floats. Those that this processor lacks must not be called.
extern const NlmKernels kNlmBaselineKernels;
#if RELUME_WIDE_KERNELS
extern const NlmKernels kNlmAvx2Kernels, kNlmAvx512Kernels;
#endif

// The widest that this processor has.
const NlmKernels& BestNlmKernels();
// All that this processor has, baseline first.
struct NlmKernelList {
    const NlmKernels* list[3];
    int size;
};
NlmKernelList UsableNlmKernels();

}  // namespace relume::denoise
