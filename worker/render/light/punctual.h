#pragma once

#include <cstdint>
#include <memory>

#include "core/scene/scene.h"
#include "worker/render/light/light_bounds.h"
#include "worker/render/light/light_sample.h"
#include "worker/render/light/sphere_map.h"

namespace relume::render {

// A light without a surface: point, spot or directional (KHR_lights_punctual), or goniometric.
struct PunctualLight {
    enum class Kind : std::uint8_t { kPoint, kSpot, kDirectional, kGoniometric };
    enum class Falloff : std::uint8_t { kSquare, kSmoothstep, kQuartic };

    Kind kind = Kind::kPoint;
    Vec3f position;
    Vec3f direction;                        // that it shines along, unit length
    Rgb strength;                           // W/sr; directional: W/m^2
    float cone_scale = 0, cone_offset = 1;  // spot: falloff of clamp(scale cos + offset, 0, 1)
    Falloff falloff = Falloff::kSquare;
    float cone_inner = 0, cone_outer = 0;  // spot: half angles, radians
    float cone_solid_angle = 0;            // spot: integral of the falloff, sr
    int image = -1;                        // goniometric: of Scene::images
    std::shared_ptr<const SphereMap> map;  // goniometric: scales strength by direction, local space
    Transform from_world;                  // goniometric

    // All but the pdf; false if no light goes to p.
    bool Illuminate(Vec3f p, LightSample* sample) const;
    // Spot: share of the intensity at this cosine from the axis.
    float Cone(float cosine) const;
    // Where it stands and shines; not of directional lights.
    LightExtent Extent() const;
    // Watts over the scene, for choosing.
    double Power(float scene_radius) const;
};

// Reads a scene's light. Throws kInvalidArgument naming the light for an unknown type or parameter.
PunctualLight CompileLight(const Scene& scene, const Light& light);

}  // namespace relume::render
