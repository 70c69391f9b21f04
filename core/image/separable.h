#pragma once

#include <span>
#include <vector>

namespace relume {

// A plane of `width` x height doubles, row-major.
using Plane = std::vector<double>;

// Correlates with the outer product of two kernels of odd length: along rows with `kernel_x`, then
// along columns with `kernel_y`; beyond the border the outermost pixels go on. The same bits for
// any number of threads.
Plane CorrelateSeparable(const Plane& in, int width, std::span<const double> kernel_x,
                         std::span<const double> kernel_y);

}  // namespace relume
