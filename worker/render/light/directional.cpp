// Light "directional": irradiance 3 numbers (W/m^2, on a surface that faces it) [1 1 1], from
// infinitely far.
#include "worker/render/bsdf/params.h"
#include "worker/render/light/punctual.h"

namespace relume::render {

PunctualLight MakeDirectional(const ParamSet& params) {
    PunctualLight light;
    light.kind = PunctualLight::Kind::kDirectional;
    light.strength = ReadColor(params, "irradiance", {1, 1, 1});
    return light;
}

}  // namespace relume::render
