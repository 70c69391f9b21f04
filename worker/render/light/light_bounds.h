#pragma once

#include <algorithm>
#include <cmath>

#include "core/math/box.h"
#include "core/math/vec.h"

namespace relume::render {

// Where light is wanted: a point and what of its surroundings it can use.
struct LightReceiver {
    Vec3f point;
    Vec3f normal;          // shading normal on the side of wo, unit length; 0: from everywhere
    bool through = false;  // takes light from behind its surface too
};

// Where a light or a group of lights stands and shines, while a tree is built (Conty Estevez and
// Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", section 4.1).
struct LightExtent {
    Box3f box;
    Vec3f axis{0, 0, 1};  // of a cone of the directions that it faces, unit length
    float spread = 0;     // half angle of that cone
    float reach = 0;      // it shines at most this far, at most pi / 2, beyond the cone
    float strength = 0;   // largest intensity (W/sr), of a group its sum
    bool both_sides = false;
};

LightExtent Unite(const LightExtent& a, const LightExtent& b);

// The same made ready for the question what arrives at a receiver.
struct LightBounds {
    Vec3f center;
    float radius2 = 0;  // of the sphere about the box
    Vec3f axis{0, 0, 1};
    float strength = 0;
    float cos_spread = 1, sin_spread = 0, cos_reach = 0;
    bool both_sides = false;

    LightBounds() = default;
    explicit LightBounds(const LightExtent& extent);

    // About what a receiver gets, visibility and its material left out: 0 only where it gets
    // nothing (up to rounding at a horizon).
    float Importance(const LightReceiver& at) const {
        const Vec3f to_light = center - at.point;
        const float distance2 = Length2(to_light);
        // The sphere's half angle as seen from the point; all around if that lies inside.
        float cos_sphere = -1, sin_sphere = 0;
        if (distance2 > radius2) {
            const float sin2 = radius2 / distance2;
            sin_sphere = std::sqrt(sin2);
            cos_sphere = std::sqrt(1 - sin2);
        }
        const float scale = distance2 > 0 ? 1 / std::sqrt(distance2) : 0;
        float importance = strength / std::max(distance2, std::max(radius2, 1e-30f));
        // Angle between the way to the point and the nearest direction that the light faces, from
        // anywhere in the sphere.
        float cos_axis = -Dot(axis, to_light) * scale;
        cos_axis = std::clamp(both_sides ? std::abs(cos_axis) : cos_axis, -1.0f, 1.0f);
        if (cos_axis < cos_spread) {
            const float sin_axis = std::sqrt(1 - cos_axis * cos_axis);
            const float c = cos_axis * cos_spread + sin_axis * sin_spread;
            if (c < cos_sphere) {
                const float s = sin_axis * cos_spread - cos_axis * sin_spread;
                const float cos_left = c * cos_sphere + s * sin_sphere;
                if (cos_left <= cos_reach) {
                    return 0;
                }
                importance *= cos_left;
            }
        }
        // The receiver's own cosine, at its largest.
        float cos_normal = Dot(at.normal, to_light) * scale;
        if (at.through) {
            cos_normal = std::abs(cos_normal);
        }
        if (cos_normal < cos_sphere && at.normal != Vec3f{}) {
            const float sin_normal = std::sqrt(std::max(0.0f, 1 - cos_normal * cos_normal));
            const float c = cos_normal * cos_sphere + sin_normal * sin_sphere;
            if (c <= 0) {
                return 0;
            }
            importance *= c;
        }
        return importance;
    }
};

}  // namespace relume::render
