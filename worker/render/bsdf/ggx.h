#pragma once

#include <algorithm>
#include <cmath>

#include "core/math/vec.h"
#include "worker/render/sampler/warp.h"

namespace relume::render {

// GGX (Trowbridge-Reitz) with height-correlated Smith masking; local space, n = +z. Walter et al.
// 2007, "Microfacet Models for Refraction"; Heitz 2014, "Understanding the Masking-Shadowing
// Function", section 5. `Alpha` may be a float (isotropic: glTF's roughness squared) or differ
// along x and y.
namespace ggx {

struct Alpha {
    float x, y;
};

// Below this the lobe is treated as a perfect mirror: narrower than any filter sees, and than
// floats like.
inline constexpr float kSmallestAlpha = 1e-3f;

inline bool IsSmooth(Alpha a) { return std::max(a.x, a.y) < kSmallestAlpha; }

// Distribution of microfacet normals.
inline float D(Vec3f h, float alpha) {
    const float a2 = alpha * alpha;
    // sin^2/a^2 + cos^2, free of the cancellation of 1 + cos^2 (a^2 - 1).
    const float t = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
    return 1 / (kPi * a2 * t * t);
}
inline float D(Vec3f h, Alpha a) {
    const float x = h.x / a.x, y = h.y / a.y;
    const float t = x * x + y * y + h.z * h.z;
    return 1 / (kPi * a.x * a.y * t * t);
}

// sqrt(cos^2 + alpha^2 sin^2), of which all Smith terms are made.
inline float Slope(Vec3f w, float alpha) {
    const float c2 = w.z * w.z;
    return std::sqrt(c2 + alpha * alpha * (1 - c2));
}
inline float Slope(Vec3f w, Alpha a) {
    const float x = w.x * a.x, y = w.y * a.y;
    return std::sqrt(w.z * w.z + x * x + y * y);
}

template <class A>
float G1(Vec3f w, A alpha) {
    return 2 * w.z / (w.z + Slope(w, alpha));
}

// Joint masking and shadowing over the denominator of the reflection: G2 / (4 cos_o cos_i). Both
// on the same side.
template <class A>
float Visibility(Vec3f wo, Vec3f wi, A alpha) {
    const float o = std::abs(wo.z), i = std::abs(wi.z);
    return 0.5f / (i * Slope(wo, alpha) + o * Slope(wi, alpha));
}

// Density of reflection about visible normals: G1(wo) D(h) / (4 cos_o).
template <class A>
float ReflectionPdf(float d, Vec3f wo, A alpha) {
    return 0.5f * d / (wo.z + Slope(wo, alpha));
}

// A normal visible from wo (z > 0), with density G1(wo) D(h) max(0, wo.h) / cos_o: spherical caps,
// Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps".
inline Vec3f SampleVisibleNormal(Vec3f wo, Alpha a, Vec2f u) {
    const Vec3f w = Normalize({a.x * wo.x, a.y * wo.y, wo.z});
    const SinCos phi = SinCosTurn(u.x);
    const float z = (1 - u.y) * (1 + w.z) - w.z;
    const float sin_theta = std::sqrt(std::clamp(1 - z * z, 0.0f, 1.0f));
    const Vec3f h = Vec3f{sin_theta * phi.cos, sin_theta * phi.sin, z} + w;
    const Vec3f m{a.x * h.x, a.y * h.y, std::max(h.z, 0.0f)};
    const float length2 = Length2(m);
    return length2 > 0 ? m * (1 / std::sqrt(length2)) : Vec3f{0, 0, 1};
}
inline Vec3f SampleVisibleNormal(Vec3f wo, float alpha, Vec2f u) {
    return SampleVisibleNormal(wo, Alpha{alpha, alpha}, u);
}

}  // namespace ggx

inline Vec3f Reflect(Vec3f w, Vec3f m) { return m * (2 * Dot(w, m)) - w; }

}  // namespace relume::render
