// Material "mix": each path takes one of its two parts by chance.
#include "worker/render/bsdf/params.h"

namespace relume::render {

CompiledMaterial MakeMix(const ParamSet& params, const Scene& scene) {
    CompiledMaterial m;
    m.model = Model::kMix;
    ReadSurfaceParams(params, scene, &m);
    m.mix_a = params.GetInt("material_a", -1);
    m.mix_b = params.GetInt("material_b", -1);
    m.amount = ReadInRange(params, "amount", 0.5f, 0, 1);
    m.amount_texture = ReadTexture(params, "amount_texture", scene);
    return m;
}

}  // namespace relume::render
