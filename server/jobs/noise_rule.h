#pragma once

#include <vector>

#include "core/film/film.h"

namespace relume::jobs {

// Relative standard deviation of one sample of each pixel, row-major over the window: sqrt of the
// mean over RGB of variance / (mean^2 + 1e-3) (methods 3.2, steps 1 to 3).
//
// A pixel's own samples take no part: where counts follow what a pixel itself happened to see, the
// image gets darker (Kirk and Arvo 1991), and a few samples know a variance to its own size at
// best. Variance and mean are those of the neighbours within 4 pixels, weighted by how alike they
// look by their features. What none of them has seen may have been seen further away: half the
// mean of 21x21 pixels is added, and a hundredth of the image's. Variances are scaled to the level
// of the halves (variance_level.h).
std::vector<float> RelativeDeviation(const Film& film);

}  // namespace relume::jobs
