// Material "dielectric": the surface of a closed solid, glass or water, that reflects and refracts.
// Parameters: ior [1.5] (inside over outside), roughness [0] (0 = smooth), tint [1 1 1] (of
// transmitted light, at each crossing). Rough: Walter et al. 2007, single scattering, so rough
// glass loses some energy. No absorption inside.
#include "worker/render/bsdf/params.h"

namespace relume::render {

CompiledMaterial MakeDielectric(const ParamSet& params, const Scene&) {
    CompiledMaterial m;
    m.has_opaque = false;
    m.has_glass = true;
    m.thin = false;
    m.transmission = 1;
    m.ior = ReadInRange(params, "ior", 1.5f, 0.1f, 100);
    m.roughness = ReadInRange(params, "roughness", 0, 0, 1);
    m.base_color = ReadColor(params, "tint", {1, 1, 1});
    return m;
}

}  // namespace relume::render
