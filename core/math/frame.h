#pragma once

#include "core/math/vec.h"

namespace relume {

// Orthonormal basis whose z is a normal (Duff et al. 2017, "Building an Orthonormal Basis,
// Revisited").
struct Frame {
    Vec3f x, y, z;

    static Frame FromZ(Vec3f n) {
        const float sign = std::copysign(1.0f, n.z);
        const float a = -1.0f / (sign + n.z);
        const float b = n.x * n.y * a;
        return {
            {1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
    }
    // x is `t` made orthogonal to n; any basis if they are parallel.
    static Frame FromZX(Vec3f n, Vec3f t) {
        const Vec3f x = t - n * Dot(n, t);
        const float length2 = Length2(x);
        if (!(length2 > 1e-12f)) {
            return FromZ(n);
        }
        const Vec3f unit = x * (1.0f / std::sqrt(length2));
        return {unit, Cross(n, unit), n};
    }
    Vec3f ToLocal(Vec3f v) const { return {Dot(v, x), Dot(v, y), Dot(v, z)}; }
    Vec3f ToWorld(Vec3f v) const { return x * v.x + y * v.y + z * v.z; }
};

}  // namespace relume
