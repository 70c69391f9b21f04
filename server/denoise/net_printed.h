#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/denoise/bilateral_tiles.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/net_printed_kernels.h"
#include "server/denoise/network/tza.h"

namespace relume::denoise {

// net:mode=printed with the weights that are there; none: throws kFailedPrecondition.
std::unique_ptr<Denoiser> MakePrintedNet();
// With these, conv0.weight, conv0.bias, ...; `source` is for messages. Weights that don't fit throw
// kInvalidArgument.
std::unique_ptr<Denoiser> MakePrintedNet(const TensorArchive& weights, const std::string& source);

// The filter with each pixel's own sigmas: five planes, of space (pixels), range (radiance),
// normal, albedo, depth. The derivative that the result has is the one for fixed sigmas.
Result FilterBySigmas(const Frame& frame, const Guides& guides, const std::vector<Plane>& sigmas,
                      NetPrintedKernel kernel, const CancelToken& cancel);

}  // namespace relume::denoise
