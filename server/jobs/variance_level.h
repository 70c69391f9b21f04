#pragma once

#include <array>
#include <vector>

#include "core/film/film.h"

namespace relume::jobs {

// What s^2/n is multiplied by, per channel and pixel: the level of the halves' variance over that
// of the samples', means of 21x21 pixels (methods 1.2, estimator 3). Samples are of low
// discrepancy, for which s^2/n alone is too high.
std::array<std::vector<float>, 3> VarianceLevel(const Film& film);

}  // namespace relume::jobs
