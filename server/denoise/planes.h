#pragma once

#include <vector>

#include "server/denoise/frame.h"

namespace relume::denoise {

// Window operations on planes of width x height. Windows are clipped at the border. Each output is
// summed directly in one fixed order: no running sums, so that a bright pixel leaves no trace
// outside its window and the bits do not depend on threads.

// Sum over the (2 radius + 1)^2 window.
Plane SumBox(const Plane& in, int width, int height, int radius);

// Sum over k in [-r, r] of taps[k + r] times the neighbour at k, first along rows, then along
// columns; outside is 0.
Plane Convolve(const Plane& in, int width, int height, const std::vector<float>& taps);

// Sum of the taps that lie in [0, size) when the middle one is at each place.
std::vector<float> TapSums(int size, const std::vector<float>& taps);

// Convolve with weights normalised over what lies in the image.
Plane BlurByTaps(const Plane& in, int width, int height, const std::vector<float>& taps);

// exp(-k^2/(2 sigma^2)) for k in [-r, r], r = 3 sigma rounded up; `sigma` in pixels.
std::vector<float> GaussianTaps(float sigma);

// Gaussian of `sigma` pixels, cut at 3 sigma, weights normalised over what lies in the image.
Plane BlurGaussian(const Plane& in, int width, int height, float sigma);

// Mean of the three planes.
Plane AverageOfThree(const Plane (&planes)[3]);

}  // namespace relume::denoise
