#pragma once

#include <memory>
#include <string>

#include "server/denoise/denoiser.h"
#include "server/denoise/network/tza.h"

namespace relume::denoise {

// The filter of kpcn.cpp with these weights, in tiles of tile x tile pixels (0: as memory allows).
// `name`: of the weights, for Describe and messages.
std::unique_ptr<Denoiser> MakeKpcn(const TensorArchive& weights, const std::string& name, int tile);

}  // namespace relume::denoise
