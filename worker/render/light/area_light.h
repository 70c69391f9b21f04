#pragma once

#include <cstdint>
#include <optional>

#include "core/math/vec.h"
#include "worker/render/light/spherical_triangle.h"

namespace relume::render {

// An emitting triangle in world space.
struct alignas(64) AreaLight {
    Vec3f p0, e1, e2;        // points are p0 + b1 e1 + b2 e2
    Vec3f normal;            // unit length, of the front
    float inverse_area = 0;  // 0: has no area, and is never drawn
    float size = 0;          // largest coordinate of the edges
    std::uint32_t object = 0, triangle = 0;

    // The triangle as `p` sees it, if it is near and large enough to be drawn from by solid angle;
    // empty: it is drawn from by area. Depends on nothing but p.
    std::optional<SphericalTriangle> SeenFrom(Vec3f p) const {
        // Nearer than this times its size, distances and cosines differ much over the triangle.
        constexpr float kNear = 4;
        // Smaller or larger solid angles suffer from rounding.
        constexpr float kLeast = 1e-3f, kMost = 6.2f;
        const Vec3f a = p0 - p;
        if (Length2(a + (e1 + e2) * (1.0f / 3)) > kNear * kNear * size * size) {
            return std::nullopt;
        }
        const SphericalTriangle triangle_seen(Normalize(a), Normalize(a + e1), Normalize(a + e2));
        const float solid_angle = triangle_seen.solid_angle();
        if (!(solid_angle >= kLeast && solid_angle <= kMost)) {
            return std::nullopt;
        }
        return triangle_seen;
    }
};
static_assert(sizeof(AreaLight) == 64);

}  // namespace relume::render
