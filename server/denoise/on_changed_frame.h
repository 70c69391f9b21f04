#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/denoise/denoiser.h"

namespace relume::denoise {

// The filter on a copy of the frame that `change` was done to. `parameter` is what its name says of
// that: "without=albedo".
std::unique_ptr<Denoiser> OnChangedFrame(std::unique_ptr<Denoiser> denoiser,
                                         const std::string& parameter,
                                         std::function<void(Frame*)> change);

}  // namespace relume::denoise
