#pragma once

#include <cstddef>
#include <vector>

#include "core/scene/scene.h"
#include "worker/render/sampler/elementary.h"
#include "worker/render/texture/texture_set.h"

namespace relume::render {

// A latitude-longitude picture of floats as Environment's, read bilinearly: periodic in x, clamped
// at the poles. Values that no light has (NaN, infinite, negative) are replaced by 0 or 65504.
class SphereMap {
  public:
    SphereMap() = default;  // none
    // Texels are those of scene.images[image] times `scale`; a = average of r, g, b times the sine
    // of the row's polar angle. Throws kInvalidArgument naming a picture that has no floats.
    SphereMap(const Scene& scene, int image, Rgb scale);

    bool empty() const { return texels_.empty(); }
    int width() const { return width_; }
    int height() const { return height_; }
    const Rgba& At(int x, int y) const {
        return texels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                       static_cast<std::size_t>(x)];
    }
    // Sum of a over all texels; times `solid_angle_scale` the integral over the sphere.
    double sum() const { return sum_; }
    // Steradians of a texel whose sine is 1: 2 pi^2 over their number.
    double solid_angle_scale() const;
    // Mean over the sphere, average of the channels.
    double mean() const { return mean_; }
    std::size_t repaired() const { return repaired_; }

    // Where a unit vector is, in texels from the corner; `sine` of its polar angle.
    struct Place {
        float x, y, sine;
    };
    Place Find(Vec3f d) const {
        const float sine = std::sqrt(d.x * d.x + d.z * d.z);
        const float u = 0.5f + Atan2(d.x, -d.z) * (0.5f * kInvPi);
        const float v = Atan2(sine, d.y) * kInvPi;  // acos(y), but accurate near the poles
        return {u * static_cast<float>(width_), v * static_cast<float>(height_), sine};
    }
    Rgba Interpolate(float x, float y) const;
    // Asks the memory for what Interpolate will read.
    void Prefetch(float x, float y) const;

  private:
    // The four texels about a place, and the weights of the second ones.
    struct Footprint {
        int x0, x1, y0, y1;
        float tx, ty;
    };
    Footprint FootprintOf(float x, float y) const;

    int width_ = 0, height_ = 0;
    std::vector<Rgba> texels_;
    double sum_ = 0, mean_ = 0;
    std::size_t repaired_ = 0;
};

}  // namespace relume::render
