// Material "diffuse": Lambert's law. Parameters: base_color [1 1 1], base_color_texture, base_alpha
// [1], emissive [0 0 0] (radiance), emissive_texture, normal_texture, normal_scale [1], alpha_mode
// [opaque], alpha_cutoff [0.5], double_sided [false].
#include "worker/render/bsdf/params.h"

namespace relume::render {

CompiledMaterial MakeDiffuse(const ParamSet& params, const Scene& scene) {
    CompiledMaterial m;
    ReadSurfaceParams(params, scene, &m);
    return m;
}

}  // namespace relume::render
