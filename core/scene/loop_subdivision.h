#pragma once

#include <vector>

#include "core/math/vec.h"

namespace relume {

// Refines a triangle mesh `levels` times by Loop's scheme ("Smooth Subdivision Surfaces Based on
// Triangles", 1987) with Warren's weights, boundaries by cubic B-splines, and moves the vertices to
// the limit surface. Edges of more than two faces count as boundaries. Corners must be in range.
void SubdivideLoop(int levels, std::vector<Vec3f>* positions, std::vector<Vec3u>* triangles);

// Unit normals of vertices: those of the faces around, by area.
std::vector<Vec3f> SmoothNormals(const std::vector<Vec3f>& positions,
                                 const std::vector<Vec3u>& triangles);

}  // namespace relume
