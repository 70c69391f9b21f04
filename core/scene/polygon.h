#pragma once

#include <vector>

#include "core/math/vec.h"

namespace relume {

// Cuts a polygon without holes into triangles of its corners' indices, with its own orientation.
// Nearly flat ones may be concave; of those only with at most kMostConcaveCorners corners all
// triangles lie inside: what has more is cut as if it were convex.
void Triangulate(const std::vector<Vec3f>& corners, std::vector<Vec3u>* triangles);

inline constexpr std::size_t kMostConcaveCorners = 512;

}  // namespace relume
