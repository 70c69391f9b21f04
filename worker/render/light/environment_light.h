#pragma once

#include <cstdint>
#include <vector>

#include "core/math/transform.h"
#include "core/scene/scene.h"
#include "worker/render/light/light_sample.h"
#include "worker/render/texture/texture_set.h"

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
    std::size_t repaired() const { return repaired_; }

    // Towards `direction` (world, unit length). `pdf`, if not null: density per solid angle of
    // Sample.
    Rgb Radiance(Vec3f direction, float* pdf) const;
    // Direction, radiance and pdf; false where there is no light.
    bool Sample(Vec2f u, LightSample* sample) const;

  private:
    // One row of cumulative probabilities, inverted from a table of first guesses (Chen and Asau
    // 1974).
    struct Row {
        const float* cumulative;     // n + 1
        const std::uint16_t* guess;  // n
        int n;
        // Index and what is left of u, stretched to [0, 1).
        int Sample(float* u) const;
    };
    Row RowOf(int y) const;
    Row Marginal() const;
    Rgba Interpolate(float x, float y) const;  // in texels from the corner

    Rgb color_;
    int width_ = 0, height_ = 0;  // 0: one colour
    std::vector<Rgba> texels_;    // a: weight in the density
    float pdf_scale_ = 0;
    std::vector<float> cumulative_;     // height rows of width + 1, then the marginal
    std::vector<std::uint16_t> guess_;  // height rows of width, then the marginal
    bool turned_ = false;
    Transform to_world_, from_world_;
    double mean_ = 0;
    std::size_t repaired_ = 0;
};

}  // namespace relume::render
