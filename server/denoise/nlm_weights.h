#pragma once

#include <vector>

#include "core/film/tile.h"
#include "server/denoise/frame.h"
#include "server/denoise/nlm_kernels.h"
#include "server/denoise/nlm_tile.h"

namespace relume::denoise {

inline constexpr float kNlmOutside = 1e30f;  // distance of a neighbour outside

// Distances and weights of non-local means (methods 1.4; Rousselle, Knaus, Zwicker 2012). For pixel
// i and its neighbour j = i + d, and a channel u with variance v:
//   D = ((u_i - u_j)^2 - alpha (v_i + min(v_i, v_j))) / (epsilon + k^2 (v_i + v_j)),
// at most `largest`; then the mean over the channels; then the mean over the patch, all pixels
// within `patch` of i: where i or j lies outside of the image the pair has no part in it. The
// weight is exp(-max(0, D)), 0 for a neighbour outside of the image.
struct NlmOptions {
    float k = 0.45f;
    float alpha = 1;
    float epsilon = 1e-10f;
    float largest = 1e4f;  // keeps a firefly's distance finite
    int patch = 3;         // pixels: (2 patch + 1)^2
    // The denominator is epsilon + 2 k^2 v_i: the neighbour's variance has no part in it.
    bool own_variance = false;
    // The pairwise trick: with w1, w2 the weights of i + d and i - d, and ws that of their mean
    // (whose variance is a quarter of the sum), both become r ws + (1 - r) w, r = ws / (w1 + w2) -
    // 1 within [0, 1]. Linear gradients, which weights flatten, are kept. Not where a neighbour
    // lies outside.
    bool symmetric = false;
    int weight_patch = 0;    // pixels: weights become their mean over such a patch
    float least_weight = 0;  // what is below then becomes 0
};

// What the weights are taken from: 1 to 3 planes of width x height and their variances.
struct NlmGuide {
    int width = 0, height = 0;
    std::vector<const Plane*> value, variance;
    float variance_scale = 1;  // 2: the variances are a frame's, the values a half's

    NlmGuide() = default;
    // Colour or any other three planes; those of `frame` itself.
    NlmGuide(int width_, int height_, const Plane (&value_)[3], const Plane (&variance_)[3],
             float scale = 1);
};

// The weights in one tile, one offset after another, with scratch memory of its own: one for each
// thread. All results are the same bits for any tile and instruction set.
class NlmWeights {
  public:
    // For tiles of at most max_width x max_height pixels and offsets of at most `radius` in x and
    // y.
    NlmWeights(const NlmOptions& options, int radius, int max_width, int max_height,
               const NlmKernels& kernels = BestNlmKernels());

    // Copies what the tile needs of the guide; `tile` lies in the image.
    void Load(const NlmGuide& guide, const TileRect& tile);

    // Weights of offset (dx, dy), not (0, 0): forward() of the neighbour at +(dx, dy), backward()
    // of that at -(dx, dy). Both cost little more than one.
    void ComputeWeights(int dx, int dy);
    // As ComputeWeights, but patch distances; kNlmOutside where there is no neighbour. If
    // `symmetric`, between() holds the distance to the mean of both neighbours.
    void ComputeDistances(int dx, int dy);

    // After ComputeDistances(dx, dy): what forward(), backward() and between() would hold for each
    // pixel if the guide had `factor` times its value in that pixel alone; in nudged(kForward) etc.
    // Not with own_variance or weight_patch.
    void ComputeNudgedDistances(int dx, int dy, float factor);

    // At the tile's first pixel, rows stride() apart; valid until the next Compute.
    float* forward() { return At(forward_); }
    float* backward() { return At(backward_); }
    float* between() { return At(between_); }
    float* nudged(NlmDirection direction) { return nudged_[direction].data(); }
    std::ptrdiff_t stride() const { return out_stride_; }

    // The weights of all offsets, 1 for the pixel itself: that of pixel (x, y) of the tile for
    // offset (dx, dy) at out[(((dy + radius) (2 radius + 1) + dx + radius) height + y) width + x].
    void ComputeAllWeights(float* out);

  private:
    float* At(std::vector<float>& plane) {
        return plane.data() + options_.weight_patch * (out_stride_ + 1);
    }
    TileRect Inside(int dx, int dy) const;
    NlmPair PairAt(const TileRect& area, int dx, int dy) const;
    struct Counts {
        std::vector<float> across, down;
    };
    void FillInverseCounts(const TileRect& area, const TileRect& keep, int patch,
                           Counts* counts) const;
    void BoxInto(const float* raw, const TileRect& raw_area, const TileRect& keep,
                 NlmDirection direction);
    void SmoothWeights(const TileRect& keep, std::vector<float>* plane);

    NlmOptions options_;
    int radius_, halo_;
    const NlmKernels& kernels_;
    int image_width_ = 0, image_height_ = 0;
    TileRect tile_;
    bool inside_loaded_ = false;
    int channels_ = 0;
    std::vector<HaloPlane> value_, variance_;  // a channel each
    std::ptrdiff_t raw_stride_, out_stride_;
    std::vector<float> raw_[2];  // distances without patch
    std::vector<float> rows_;
    Counts counts_[kNlmDirections];  // one over the number of patch pixels: columns times rows
    std::vector<float> forward_, backward_, between_, smooth_;
    std::vector<float> inside_, nudged_[kNlmDirections];  // of ComputeNudgedDistances alone
};

}  // namespace relume::denoise
