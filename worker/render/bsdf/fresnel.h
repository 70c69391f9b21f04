#pragma once

#include <algorithm>
#include <cmath>

#include "core/math/vec.h"

namespace relume::render {

// (1 - c)^5, the shape of Schlick's approximation (1994).
inline float SchlickWeight(float cos_theta) {
    const float m = std::clamp(1 - cos_theta, 0.0f, 1.0f);
    const float m2 = m * m;
    return m2 * m2 * m;
}

inline Rgb FresnelSchlick(Rgb f0, float f90, float cos_theta) {
    return f0 + (Rgb{f90, f90, f90} - f0) * SchlickWeight(cos_theta);
}

// Reflectance of a smooth dielectric for unpolarised light; `cos_i` >= 0 on the incident side,
// `eta` the refractive index behind the surface over the one before it. 1 at total internal
// reflection.
inline float FresnelDielectric(float cos_i, float eta) {
    const float sin2_t = (1 - cos_i * cos_i) / (eta * eta);
    if (sin2_t >= 1) {
        return 1;
    }
    const float cos_t = std::sqrt(1 - sin2_t);
    const float parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    const float perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    return 0.5f * (parallel * parallel + perpendicular * perpendicular);
}

// Direction of the ray refracted at a facet m (on the side of w) for the same `eta`; false at total
// reflection.
inline bool Refract(Vec3f w, Vec3f m, float eta, Vec3f* out) {
    const float cos_i = Dot(w, m);
    const float sin2_t = std::max(0.0f, 1 - cos_i * cos_i) / (eta * eta);
    if (sin2_t >= 1) {
        return false;
    }
    *out = m * (cos_i / eta - std::sqrt(1 - sin2_t)) - w / eta;
    return true;
}

// Reflectance of a conductor of index eta + i k for unpolarised light, one channel.
inline float FresnelConductor(float cos_i, float eta, float k) {
    const float c2 = cos_i * cos_i, s2 = 1 - c2;
    const float t0 = eta * eta - k * k - s2;
    const float a2b2 = std::sqrt(t0 * t0 + 4 * eta * eta * k * k);
    const float t1 = a2b2 + c2;
    const float t2 = 2 * cos_i * std::sqrt(std::max(0.0f, 0.5f * (a2b2 + t0)));
    const float perpendicular = (t1 - t2) / (t1 + t2);
    const float t3 = c2 * a2b2 + s2 * s2, t4 = t2 * s2;
    return 0.5f * perpendicular * (1 + (t3 - t4) / (t3 + t4));
}

// Reflectance at normal incidence.
inline float F0FromIor(float ior) {
    const float r = (ior - 1) / (ior + 1);
    return r * r;
}

}  // namespace relume::render
