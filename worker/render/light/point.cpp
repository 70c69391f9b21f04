// Light "point": intensity 3 numbers (W/sr) [1 1 1], alike in all directions.
#include "worker/render/bsdf/params.h"
#include "worker/render/light/punctual.h"

namespace relume::render {

PunctualLight MakePoint(const ParamSet& params) {
    PunctualLight light;
    light.kind = PunctualLight::Kind::kPoint;
    light.strength = ReadColor(params, "intensity", {1, 1, 1});
    return light;
}

}  // namespace relume::render
