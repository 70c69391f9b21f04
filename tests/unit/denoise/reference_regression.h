#pragma once

#include <array>

#include "server/denoise/regression.h"

namespace relume::denoise {

// First-order collaborative regression pixel by pixel in double, weights by ReferenceNlm: least
// squares with `ridge` of each centred column's variance, and kConstantVariance, more on the
// diagonal.
std::array<Plane, 3> ReferenceRegression(const RegressionInput& input, double ridge);

}  // namespace relume::denoise
