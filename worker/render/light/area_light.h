#pragma once

#include <cstdint>

#include "core/math/vec.h"

namespace relume::render {

// An emitting triangle in world space.
struct alignas(64) AreaLight {
    Vec3f p0, e1, e2;  // points are p0 + b1 e1 + b2 e2
    Vec3f normal;      // unit length, of the front
    float pdf = 0;     // density per area of being drawn, choice of light included
    float size = 0;    // largest coordinate of the edges
    std::uint32_t object = 0, triangle = 0;
};
static_assert(sizeof(AreaLight) == 64);

}  // namespace relume::render
