#pragma once

#include "server/denoise/frame.h"

namespace relume::denoise {

// Shares `samples` out in proportion to `priority` (none below 0): expected counts a pixel,
// `samples` in all. No pixel gets fewer than `fewest`; none more than `most`, unless all that ask
// have as many: the rest goes to all alike. Even shares where the mean is not between the two.
Plane ShareSamples(const Plane& priority, double samples, double fewest, double most);

}  // namespace relume::denoise
