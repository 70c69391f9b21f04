// Light "spot": intensity 3 numbers (W/sr, on the axis) [1 1 1], inner_angle [0], outer_angle
// [pi/4] (radians from the axis, at most pi): full inside the inner cone, nothing outside the outer
// one. falloff ["gltf"] between them, with t linear in the cosine: "gltf" t^2
// (KHR_lights_punctual), "smoothstep" 3 t^2 - 2 t^3 (pbrt-v4), "quartic" t^4 (pbrt-v3).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "worker/render/bsdf/params.h"
#include "worker/render/light/punctual.h"

namespace relume::render {
namespace {

constexpr float kLeastRamp = 1e-6f;  // of the cosine: a sharp edge

}  // namespace

PunctualLight MakeSpot(const ParamSet& params) {
    PunctualLight light;
    light.kind = PunctualLight::Kind::kSpot;
    light.strength = ReadColor(params, "intensity", {1, 1, 1});
    const float inner = ReadInRange(params, "inner_angle", 0, 0, kPi);
    const float outer = ReadInRange(params, "outer_angle", kPi / 4, 0, kPi);
    const std::string falloff =
        params.GetChoice("falloff", "gltf", {"gltf", "smoothstep", "quartic"});
    if (!(inner <= outer)) {
        ThrowInvalidArgument(fmt::format("inner_angle {} is above outer_angle {}", inner, outer));
    }
    light.falloff = falloff == "gltf"         ? PunctualLight::Falloff::kSquare
                    : falloff == "smoothstep" ? PunctualLight::Falloff::kSmoothstep
                                              : PunctualLight::Falloff::kQuartic;
    const float start = std::cos(inner), end = std::cos(outer);
    light.cone_scale = 1 / std::max(kLeastRamp, start - end);
    light.cone_offset = -end * light.cone_scale;
    light.cone_inner = inner;
    light.cone_outer = outer;
    // The integral of the falloff over t from 0 to 1 is the share of the ramp that is lit.
    const float share = light.falloff == PunctualLight::Falloff::kSquare       ? 1.0f / 3
                        : light.falloff == PunctualLight::Falloff::kSmoothstep ? 1.0f / 2
                                                                               : 1.0f / 5;
    light.cone_solid_angle = 2 * kPi * ((1 - start) + (start - end) * share);
    return light;
}

}  // namespace relume::render
