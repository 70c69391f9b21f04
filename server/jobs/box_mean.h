#pragma once

#include <vector>

namespace relume::jobs {

// Mean over 21x21 pixels of a row-major plane, clipped at the border; in an image thinner than that
// over as many along its long side. One huge value leaves no trace outside its box.
std::vector<float> BoxMean(const std::vector<float>& plane, int width, int height);

}  // namespace relume::jobs
