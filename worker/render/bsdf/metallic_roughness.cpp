// Material "metallic_roughness": glTF 2.0, appendix B, with KHR_materials_transmission and
// KHR_materials_ior. Parameters: those of "diffuse"; metallic [1], roughness [1],
// metallic_roughness_texture (G roughness, B metallic), transmission [0], transmission_texture (R),
// ior [1.5], thin [true] (no volume behind it). GGX reflection over a diffuse base that gets what
// the reflection leaves; metals compensate for multiple scattering between microfacets (Kulla and
// Conty 2017).
#include "worker/render/bsdf/params.h"

namespace relume::render {

CompiledMaterial MakeMetallicRoughness(const ParamSet& params, const Scene& scene) {
    CompiledMaterial m;
    ReadSurfaceParams(params, scene, &m);
    m.has_specular = true;
    m.metallic = ReadInRange(params, "metallic", 1, 0, 1);
    m.roughness = ReadInRange(params, "roughness", 1, 0, 1);
    m.metallic_roughness_texture = ReadTexture(params, "metallic_roughness_texture", scene);
    m.ior = ReadInRange(params, "ior", 1.5f, 0.1f, 100);
    m.transmission = ReadInRange(params, "transmission", 0, 0, 1);
    m.transmission_texture = ReadTexture(params, "transmission_texture", scene);
    m.thin = params.GetBool("thin", true);
    m.has_glass = m.transmission > 0;
    if (m.metallic == 0 && m.metallic_roughness_texture >= 0 && m.roughness == 0) {
        m.metallic_roughness_texture = -1;  // scaled by zero
    }
    return m;
}

}  // namespace relume::render
