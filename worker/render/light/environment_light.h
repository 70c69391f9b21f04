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
    // The scene's.
    explicit EnvironmentLight(const Scene& scene);

    bool black() const { return !(mean_ > 0); }
    // Mean radiance over the sphere, average of the channels.
    double mean() const { return mean_; }
    // NaN, infinite or negative values of the map, replaced by 0 or 65504.
    std::size_t repaired() const { return map_.repaired(); }

    // A direction and its place in the map, whose texels the memory has been asked for: the longer
    // the time to RadianceAt, the better.
    struct Place {
        Vec3f direction;  // world, unit length
        SphereMap::Place in_map{};
    };
    // Of a direction drawn by Sample's density.
    Place Draw(Vec2f u) const;
    Place Find(Vec3f direction) const;
    // `pdf`, if not null: density per solid angle of Draw.
    Rgb RadianceAt(const Place& place, float* pdf) const;

    Rgb Radiance(Vec3f direction, float* pdf) const { return RadianceAt(Find(direction), pdf); }
    // Direction, radiance and pdf; false where there is no light.
    bool SampleAt(const Place& drawn, LightSample* sample) const;
    bool Sample(Vec2f u, LightSample* sample) const { return SampleAt(Draw(u), sample); }

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
