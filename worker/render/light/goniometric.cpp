// Light "goniometric": intensity 3 numbers (W/sr) [1 1 1], times what the picture `image` (index of
// Scene::images, linear floats in latitude and longitude) has in that direction.
#include "worker/render/bsdf/params.h"
#include "worker/render/light/punctual.h"

namespace relume::render {

PunctualLight MakeGoniometric(const ParamSet& params) {
    PunctualLight light;
    light.kind = PunctualLight::Kind::kGoniometric;
    light.strength = ReadColor(params, "intensity", {1, 1, 1});
    light.image = params.GetInt("image", -1);
    return light;
}

}  // namespace relume::render
