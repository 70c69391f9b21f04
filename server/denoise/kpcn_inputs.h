#pragma once

#include <array>
#include <string>
#include <vector>

#include "server/denoise/frame.h"

namespace relume::denoise {

// What the network of `kpcn` sees, and what its kernels are applied to; train/kpcn.py has the same.
struct KpcnInputs {
    std::vector<Plane> channels;  // KpcnInputNames()
    // Albedo + 0.03, and 1 less the normal's length, so that the open sky is divided by about 1; 1
    // without albedo. (The paper has albedo + 0.00316: what black surfaces mirror would outshine,
    // over that, all that is beside them.)
    std::array<Plane, 3> divisor;
    std::array<Plane, 3> demodulated;  // radiance over the divisor
};

// Names of the channels, in order: each of colour, normal, depth and albedo, then its noise, then
// the steps of each channel from the pixel at the left, then those from the pixel above.
std::vector<std::string> KpcnInputNames();

// What depths are multiplied by: 1 over the largest.
float KpcnDepthScale(const Frame& frame);

// Colour is log(1 + radiance over divisor); the noise is the root of the variance of the pixel's
// mean (colour: in the logarithm's units). Zeros for features that the frame lacks, and for steps
// at the frame's left and upper border.
KpcnInputs MakeKpcnInputs(const Frame& frame, float depth_scale);

}  // namespace relume::denoise
