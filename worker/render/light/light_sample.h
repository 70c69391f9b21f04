#pragma once

#include <limits>

#include "core/math/vec.h"

namespace relume::render {

// Light that may reach a point from one direction, visibility left out.
struct LightSample {
    Vec3f wi;  // unit length, to the light
    float distance = std::numeric_limits<float>::infinity();
    float clearance = 0;  // a shadow ray that ends this much short does not meet the light itself
    Rgb radiance;  // of a delta light: what f cos is multiplied by (W/sr over distance^2, or W/m^2)
    float pdf =
        0;  // per solid angle, choice of light included; of a delta light: of the choice alone
    bool delta = false;  // no other way of sampling can find it
};

// Weight of a sample drawn with density `own` beside one drawn with `other` (Veach 1997, power
// heuristic, 9.2.3).
inline float PowerHeuristic(float own, float other) {
    const float r = other / own;
    return 1 / (1 + r * r);
}

}  // namespace relume::render
