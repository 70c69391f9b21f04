#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>

#include "core/film/tile.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/kpcn_kernels.h"
#include "server/denoise/network/tza.h"

namespace relume::denoise {

// Filter `kpcn` with these weights, conv0.weight, conv0.bias, ...; `size` is its parameter,
// `source` is for messages. Weights that don't fit throw kInvalidArgument.
std::unique_ptr<Denoiser> MakeKpcn(const std::string& size, const TensorArchive& weights,
                                   const std::string& source);

// Planes that kernels are applied to, and where they lie in their frame.
struct KpcnArea {
    std::array<const float*, 3> image;  // of `area`, row-major
    TileRect area;                      // with all that the windows of `inner` reach in the frame
    TileRect inner;                     // what is filtered
    int frame_width, frame_height;      // pixels; beyond the frame, the image is mirrored
};

// Each pixel of `inner` becomes the mean of its window by the weights exp(logit); `logits`: a plane
// of the area a pixel of the window. Writes the frame's planes: R, G, B, own share.
void ApplyKpcnKernels(std::span<const Plane> logits, const KpcnArea& tile, KpcnKernel kernel,
                      const std::array<Plane*, kKpcnOutputs>& out);

}  // namespace relume::denoise
