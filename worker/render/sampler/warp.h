#pragma once

#include <algorithm>
#include <cmath>

#include "core/math/vec.h"

namespace relume::render {

struct SinCos {
    float sin, cos;
};

// For |x| <= pi/4, by Taylor series; error below 4e-8. libm is avoided on the sampling path: it is
// slower, and picks its code by CPU.
inline SinCos SinCosQuarter(float x) {
    const float x2 = x * x;
    const float s =
        x * (1 + x2 * (-1.0f / 6 + x2 * (1.0f / 120 + x2 * (-1.0f / 5040 + x2 / 362880))));
    const float c = 1 + x2 * (-0.5f + x2 * (1.0f / 24 + x2 * (-1.0f / 720 + x2 / 40320)));
    return {s, c};
}

// Sine and cosine of 2 pi u, for u in [0, 1].
inline SinCos SinCosTurn(float u) {
    const int quadrant = static_cast<int>(4 * u + 0.5f);
    const SinCos r = SinCosQuarter((u - 0.25f * static_cast<float>(quadrant)) * (2 * kPi));
    switch (quadrant & 3) {
        case 0:
            return r;
        case 1:
            return {r.cos, -r.sin};
        case 2:
            return {-r.sin, -r.cos};
        default:
            return {-r.cos, r.sin};
    }
}

// Uniform on the unit disk; concentric (Shirley and Chiu 1997), which keeps strata compact.
inline Vec2f SampleDisk(Vec2f u) {
    const float a = 2 * u.x - 1, b = 2 * u.y - 1;
    if (a == 0 && b == 0) {
        return {0, 0};
    }
    if (std::abs(a) > std::abs(b)) {
        const SinCos t = SinCosQuarter(kPi / 4 * (b / a));
        return {a * t.cos, a * t.sin};
    }
    const SinCos t = SinCosQuarter(kPi / 4 * (a / b));
    return {b * t.sin, b * t.cos};
}

// About +z with density cos / pi (Malley's method).
inline Vec3f SampleCosineHemisphere(Vec2f u) {
    const Vec2f d = SampleDisk(u);
    return {d.x, d.y, std::sqrt(std::max(0.0f, 1 - d.x * d.x - d.y * d.y))};
}
inline float CosineHemispherePdf(float cos_theta) { return std::max(0.0f, cos_theta) * kInvPi; }

// Uniform on the unit sphere, density 1 / (4 pi).
inline Vec3f SampleSphere(Vec2f u) {
    const float z = 1 - 2 * u.x;
    const float r = std::sqrt(std::max(0.0f, 1 - z * z));
    const SinCos phi = SinCosTurn(u.y);
    return {r * phi.cos, r * phi.sin, z};
}

struct Barycentric {
    float b1, b2;  // weights of the second and third vertex
};

// Uniform on a triangle, by the map of least distortion of Heitz 2019, "A Low-Distortion Map
// Between Triangle and Square".
inline Barycentric SampleTriangle(Vec2f u) {
    if (u.y > u.x) {
        const float x = 0.5f * u.x;
        return {x, u.y - x};
    }
    const float y = 0.5f * u.y;
    return {u.x - y, y};
}

// Density of the tent filter's two halves on [-1, 1], by inversion.
inline float SampleTent(float u) {
    return u < 0.5f ? -1 + std::sqrt(2 * u) : 1 - std::sqrt(2 - 2 * u);
}

}  // namespace relume::render
