#pragma once

#include <limits>

#include "core/math/vec.h"

namespace relume {

// Axis-aligned box; empty until something is added.
struct Box3f {
    Vec3f lower{std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
                std::numeric_limits<float>::infinity()};
    Vec3f upper{-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
                -std::numeric_limits<float>::infinity()};

    void Add(Vec3f p) {
        lower = Min(lower, p);
        upper = Max(upper, p);
    }
    bool empty() const { return lower.x > upper.x; }
    Vec3f center() const { return (lower + upper) * 0.5f; }
    float radius() const { return 0.5f * Length(upper - lower); }
};

}  // namespace relume
