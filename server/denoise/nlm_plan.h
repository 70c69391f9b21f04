#pragma once

#include "server/denoise/frame.h"

namespace relume::denoise {

// Expected counts in proportion to `error` (negative: 0), `samples` in all, none above `most` times
// their mean: what is cut off goes to the others in the same proportion, evenly if they have no
// error (methods 2.3, step 4).
Plane SpreadSamples(const Plane& error, double samples, double most = 8);

}  // namespace relume::denoise
