// Light "spot": intensity 3 numbers (W/sr, on the axis) [1 1 1], inner_angle [0], outer_angle
// [pi/4] (radians from the axis): full inside the inner cone, nothing outside the outer one.
// Falloff: KHR_lights_punctual.
#include <fmt/format.h>

#include <cmath>

#include "core/base/error.h"
#include "worker/render/bsdf/params.h"
#include "worker/render/light/punctual.h"

namespace relume::render {

PunctualLight MakeSpot(const ParamSet& params) {
    PunctualLight light;
    light.kind = PunctualLight::Kind::kSpot;
    light.strength = ReadColor(params, "intensity", {1, 1, 1});
    const float inner = ReadInRange(params, "inner_angle", 0, 0, kPi / 2);
    const float outer = ReadInRange(params, "outer_angle", kPi / 4, 0, kPi / 2);
    if (!(inner <= outer)) {
        ThrowInvalidArgument(fmt::format("inner_angle {} is above outer_angle {}", inner, outer));
    }
    light.cone_scale = 1 / std::max(0.001f, std::cos(inner) - std::cos(outer));
    light.cone_offset = -std::cos(outer) * light.cone_scale;
    light.cone_solid_angle = 2 * kPi * (1 - std::cos(0.5f * (inner + outer)));
    return light;
}

}  // namespace relume::render
