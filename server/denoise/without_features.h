#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/denoise/denoiser.h"

namespace relume::denoise {

// The filter, blind to some groups of features: any filter's parameter `without`, names joined by
// '-'. An unknown name throws kInvalidArgument with the known ones.
std::unique_ptr<Denoiser> WithoutFeatures(std::unique_ptr<Denoiser> denoiser,
                                          const std::string& names);

}  // namespace relume::denoise
