#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/film/film.h"

namespace relume::jobs {

// The robust selector's numbers (methods 3.2, steps 1 to 3), each row-major over the window.

// Relative standard deviation of one sample: sqrt of the mean over RGB of variance / (mean^2 +
// 1e-3). Both are pooled over those of 5x5 pixels that look at the same thing by their features:
// one pixel's own are too uncertain, and where counts follow what a pixel itself happened to see,
// the image gets darker or brighter. Variances are scaled to the level of the halves. It is at
// least what an event as bright as the largest sample in 15x15 pixels would give that none of their
// samples needs to have seen (95 %).
std::vector<float> RelativeDeviation(const Film& film);

// New samples of each pixel, `budget` in all (one less if it is odd), in pairs: in proportion to
// the deviation counting what is planned already (Neyman 1934), but at most three times that.
// `salt` chooses which pixels get the odd pair. All 0 if no pixel has any deviation.
std::vector<std::uint32_t> ShareByDeviation(std::span<const std::uint32_t> planned,
                                            const std::vector<float>& deviation,
                                            std::uint64_t budget, std::uint32_t salt);

}  // namespace relume::jobs
