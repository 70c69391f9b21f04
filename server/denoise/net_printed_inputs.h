#pragma once

#include <string>
#include <vector>

#include "server/denoise/bilateral_tiles.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// What the network of `net:mode=printed` sees; train/printed.py has the same.
std::vector<std::string> PrintedNetInputNames();

// log(1 + radiance) and its noise in these units, normal, albedo, depth over the largest, the noise
// of each, log(1 + Sobel gradient of the noisy image), logarithm of the count of samples. Noise is
// the root of the variance of the pixel's mean, mean over the channels. Zeros for what the frame
// lacks. `guides`: of the frame.
std::vector<Plane> MakePrintedNetInputs(const Frame& frame, const Guides& guides);

}  // namespace relume::denoise
