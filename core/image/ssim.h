#pragma once

#include "core/image/separable.h"

namespace relume {

// Mean SSIM of two planes in [0,1]: Wang, Bovik, Sheikh, Simoncelli, "Image quality assessment",
// 2004; 11x11 Gaussian window of sigma 1.5, K1 = 0.01, K2 = 0.03, L = 1, only windows that lie
// inside. NaN below 11x11 pixels.
double MeanSsim(const Plane& a, const Plane& b, int width);

}  // namespace relume
