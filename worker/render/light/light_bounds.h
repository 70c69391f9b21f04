#pragma once

#include <cstddef>

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

// Eight numbers side by side, in one AVX register.
using Float8 = float __attribute__((vector_size(32)));

// Eight such extents made ready for the question what arrives at a receiver.
class LightGroup {
  public:
    static constexpr std::size_t kSize = 8;

    void Set(std::size_t i, const LightExtent& extent);

    // About what a receiver gets from each, visibility and its material left out: 0 only where it
    // gets nothing (up to rounding at a horizon), and of those that are not set.
    Float8 Importance(const LightReceiver& at) const;

  private:
    // The sphere about the box. Its radius is never 0, so that there is nothing to divide by 0.
    Float8 x_{}, y_{}, z_{}, radius2_ = Float8{} + 1;
    Float8 axis_x_{}, axis_y_{}, axis_z_{};
    Float8 cos_spread_{}, sin_spread_{}, cos_reach_{};
    Float8 strength_{};
    Float8 both_sides_{};  // 1 or 0
};

}  // namespace relume::render
