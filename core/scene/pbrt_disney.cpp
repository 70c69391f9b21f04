#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/scene/pbrt_materials.h"

// pbrt-v3's "disney" as "metallic_roughness", where it maps: its base, metal, transmission, sheen
// and clearcoat. What has no counterpart (anisotropic, flatness, difftrans, scatterdistance) is
// noted as a parameter that is not supported.
namespace relume::pbrt {

void Materials::ConvertDisney(const Declared& from, int before, Material* material) {
    const Params& params = from.params;
    material->type = "metallic_roughness";
    SetColor(params, "color", before, {0.5f, 0.5f, 0.5f}, "base_color", material);
    const auto number = [&](const char* name, float otherwise, const char* as) {
        const Value value = textures_->Number(params, name, before, otherwise);
        if (value.texture >= 0) {
            notes_->Add(from.place, fmt::format("disney: a texture for {} is not supported: {} is "
                                                "used",
                                                name, otherwise));
        }
        material->params.Set(
            as, std::clamp(value.texture >= 0 ? otherwise : value.factor.x, 0.0f, 1.0f));
    };
    number("metallic", 0, "metallic");
    number("roughness", 0.5f, "roughness");
    number("spectrans", 0, "transmission");
    material->params.Set("ior", Index(params, 1.5f));
    material->params.Set("thin", params.Bool("thin", false));
    // Burley 2012: tints are the colour without its brightness; the coat has a quarter of its
    // strength, and a GGX alpha from 0.1 (gloss 0) to 0.001.
    const Rgb color =
        textures_->Color(params, "color", before, SpectrumUse::kReflectance, {0.5f, 0.5f, 0.5f})
            .factor;
    const Rgb tint = Luminance(color) > 0 ? color / Luminance(color) : Rgb{1, 1, 1};
    const auto plain = [&](const char* name, float otherwise) {
        return std::clamp(
            spectra_->Get(params, name, SpectrumUse::kIndex, Rgb{1, 1, 1} * otherwise).y, 0.0f,
            1.0f);
    };
    const float sheen = plain("sheen", 0), sheen_tint = plain("sheentint", 0.5f);
    if (sheen > 0) {
        SetRgb(Lerp(sheen_tint, {1, 1, 1}, tint) * sheen, "sheen_color", material);
        material->params.Set("sheen_roughness", 0.5f);
    }
    const float coat = plain("clearcoat", 0), gloss = plain("clearcoatgloss", 1);
    if (coat > 0) {
        material->params.Set("clearcoat", 0.25f * coat);
        material->params.Set("clearcoat_roughness", std::sqrt(0.1f + gloss * (0.001f - 0.1f)));
    }
    if (const float specular_tint = plain("speculartint", 0); specular_tint > 0) {
        SetRgb(Lerp(specular_tint, {1, 1, 1}, tint), "specular_color", material);
    }
}

}  // namespace relume::pbrt
