#pragma once

#include <array>
#include <vector>

#include "core/scene/motion.h"
#include "core/scene/pbrt_document.h"

namespace relume::pbrt {

// Between its two ends a transformation is a translation, a rotation and a scale (with skew), each
// interpolated on its own, the rotation by slerp: pbrt's AnimatedTransform; after Shoemake and Duff
// 1992, "Matrix Animation and Polar Decomposition".
//
// `times` are those at which the shutter is looked at, `ends` those of the two transformations;
// outside of them it stands still. One sample if it does so all the time. Throws naming the place
// if an end is singular.
SampledTransform SampleBetween(const Ctm& ctm, const std::array<float, 2>& ends,
                               const std::vector<double>& times, const Place& place);

}  // namespace relume::pbrt
