#pragma once

#include <vector>

namespace relume::jobs {

// Mean over 21x21 pixels of a row-major plane, clipped at the border. One huge value leaves no
// trace outside its box.
std::vector<float> BoxMean(const std::vector<float>& plane, int width, int height);

}  // namespace relume::jobs
