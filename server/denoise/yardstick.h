#pragma once

#include <array>

#include "server/denoise/frame.h"

namespace relume::denoise {

// The square of what a pixel's error is relative to, when no reference is there: that of the pixel,
// if it is known well, that is if it and its neighbours are much less noisy than bright. Else that
// of the mean of its neighbours within 2 pixels, nearer ones and those that look alike by their
// features before others: one that is bright by chance must not be its own yardstick. Nor is the
// filtered pixel: what the filter took from bright neighbours would hide its error.
std::array<Plane, 3> SquaredYardstick(const Frame& frame);

}  // namespace relume::denoise
