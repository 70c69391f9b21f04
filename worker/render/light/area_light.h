#pragma once

#include <cstdint>
#include <optional>

#include "core/math/vec.h"
#include "worker/render/light/spherical_triangle.h"

namespace relume::render {

// An emitting triangle in world space, or two that make a parallelogram.
struct alignas(64) AreaLight {
    // Points are p0 + b1 e1 + b2 e2, b1 and b2 from 0 to 1; of a triangle b1 + b2 at most 1.
    Vec3f p0, e1, e2;
    Vec3f normal;            // unit length, of the front
    float inverse_area = 0;  // 0: has no area, and is never drawn
    float size = 0;          // largest coordinate of the edges
    std::uint32_t object = 0;
    std::uint32_t triangle : 31 = 0;
    std::uint32_t parallelogram : 1 = 0;

    // As `p` sees it, if it is near and large enough to be drawn from by solid angle; empty: it is
    // drawn from by area. Depends on nothing but p.
    std::optional<SphericalQuad> SeenFrom(Vec3f p) const {
        // Nearer than this times its size, distances and cosines differ much over it.
        constexpr float kNear = 1.5f;
        // Smaller or larger solid angles suffer from rounding.
        constexpr float kLeast = 1e-3f, kMost = 6.2f;
        const Vec3f a = p0 - p;
        const float middle = parallelogram != 0 ? 1.0f / 2 : 1.0f / 3;
        if (Length2(a + (e1 + e2) * middle) > kNear * kNear * size * size) {
            return std::nullopt;
        }
        const Vec3f b = Normalize(a + e1), c = Normalize(a + e2);
        const SphericalQuad seen = parallelogram != 0
                                       ? SphericalQuad(Normalize(a), b, c, Normalize(a + e1 + e2))
                                       : SphericalQuad(Normalize(a), b, c);
        if (!(seen.solid_angle() >= kLeast && seen.solid_angle() <= kMost)) {
            return std::nullopt;
        }
        return seen;
    }
};
static_assert(sizeof(AreaLight) == 64);

}  // namespace relume::render
