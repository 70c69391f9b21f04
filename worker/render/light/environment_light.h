#pragma once

#include "core/math/transform.h"
#include "core/scene/scene.h"
#include "worker/render/light/light_sample.h"
#include "worker/render/light/sphere_map.h"
#include "worker/render/light/texel_table.h"

namespace relume::render {

// Light from infinitely far: one colour, or a latitude-longitude map read bilinearly. Directions
// are drawn with a density that is the bilinear interpolation of luminance times the sine of each
// texel's row: a texel by its weight, then a place under its tent. So density and radiance have the
// same shape between texels, and a bright sun gives no noise.
class EnvironmentLight {
  public:
    EnvironmentLight() = default;  // black
    EnvironmentLight(const Scene& scene, const Environment& environment);

    bool black() const { return !(mean_ > 0); }
    // Mean radiance over the sphere, average of the channels.
    double mean() const { return mean_; }
    // NaN, infinite or negative values of the map, replaced by 0 or 65504.
    std::size_t repaired() const { return map_.repaired(); }

    // Towards `direction` (world, unit length). `pdf`, if not null: density per solid angle of
    // Sample.
    Rgb Radiance(Vec3f direction, float* pdf) const;
    // Direction, radiance and pdf; false where there is no light.
    bool Sample(Vec2f u, LightSample* sample) const;

  private:
    Rgb color_;
    SphereMap map_;  // empty: one colour
    TexelTable table_;
    float pdf_scale_ = 0;
    bool turned_ = false;
    Transform to_world_, from_world_;
    double mean_ = 0;
};

}  // namespace relume::render
