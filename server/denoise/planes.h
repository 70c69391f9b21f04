#pragma once

#include <vector>

#include "server/denoise/frame.h"

namespace relume::denoise {

// Window operations on planes of width x height. Windows are clipped at the border. Each output is
// summed directly in one fixed order: no running sums, so that a bright pixel leaves no trace
// outside its window and the bits do not depend on threads.

// Sum over the (2 radius + 1)^2 window.
Plane SumBox(const Plane& in, int width, int height, int radius);

// Gaussian of `sigma` pixels, cut at 3 sigma, weights normalised over what lies in the image.
Plane BlurGaussian(const Plane& in, int width, int height, float sigma);

// Mean of the three planes.
Plane AverageOfThree(const Plane (&planes)[3]);

}  // namespace relume::denoise
