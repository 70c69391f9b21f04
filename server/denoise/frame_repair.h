#pragma once

#include <vector>

#include "server/denoise/frame.h"

namespace relume::denoise {

// What FrameFromFilm and FrameFromImage share: values and variances for pixels that have none.

// A larger magnitude than this is no radiance: its square would not fit a float. Treated as not
// finite.
inline constexpr float kLargestValue = 1e15f;
bool IsUsable(float value);

// One byte a pixel, 1 = has no value.
using Holes = std::vector<unsigned char>;

// Gives holes the mean of their 3x3 neighbours' values and the largest of their variances, ring
// after ring from the holes' rims inward, so that holes of any size are filled; all is 0 if no
// pixel has a value.
void FillHoles(int width, int height, const Holes& holes, const std::vector<Plane*>& values,
               const std::vector<Plane*>& variances);

// `variance` of one sample, known where `freedom` (n - 1) is above 0. The others get the mean over
// their 5x5 window, weighted by freedom; over the frame if that is empty too (methods 3.2). False
// if no pixel has any.
bool PoolUnknown(int width, int height, const Plane& freedom, Plane* variance);

// Keeps the shape of `sample` and takes the level of `halves`, both variances of the mean:
// methods 1.2, estimator 3, over 21x21 windows. `known` is 1 where both are, 0 elsewhere.
Plane Regularise(int width, int height, const Plane& sample, const Plane& halves,
                 const Plane& known);

// Noise of an image with nothing else to tell it: mean over 5x5 of the squared response of the mask
// (1 -2 1; -2 4 -2; 1 -2 1)/6, which is blind to bilinear gradients (Immerkaer 1996). Texture is
// taken for noise. 0 if a side is below 3 pixels.
Plane LocalDifferenceVariance(int width, int height, const Plane& values);

}  // namespace relume::denoise
