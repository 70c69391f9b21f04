#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "core/math/vec.h"
#include "worker/render/bsdf/coat_table.h"
#include "worker/render/texture/texture_set.h"

namespace relume::render {

enum class AlphaMode : std::uint8_t { kOpaque, kMask, kBlend };

// How a surface scatters: what Bsdf switches on.
enum class Model : std::uint8_t {
    kDiffuse,
    kMetallicRoughness,
    kLayered,  // the same under sheen or a clear coat
    kConductor,
    kCoatedDiffuse,
    kCoatedConductor,
    kDielectric,
    kThinDielectric,
    kDiffuseTransmission,
    kMix,
};

// A material with its parameters read, for all types: plain data. A type is a way to fill it
// (registry.cpp); what each means stands with the types in core/scene/scene.h. A texture of -1 is
// none.
struct CompiledMaterial {
    Model model = Model::kDiffuse;
    AlphaMode alpha_mode = AlphaMode::kOpaque;
    bool double_sided = false;  // shines from its back too
    bool thin = true;           // glass without a volume behind it
    bool has_glass = false;     // of metallic_roughness: transmission is not 0
    bool fresnel = true;        // of conductors: false reflects `base_color` at every angle
    bool absorbs = false;       // `absorption` is not 0
    bool anisotropic = false;   // the shading frame must follow the tangent
    bool needs_uv = false, needs_tangents = false;  // see FinishMaterials

    int pack = -1;  // that base colour, normal and metallic-roughness textures are read by

    Rgb base_color{1, 1, 1};
    TextureId base_color_texture = -1;
    float metallic = 0, roughness = 1;
    TextureId metallic_roughness_texture = -1;  // G roughness, B metallic
    float ior = 1.5f;
    float transmission = 0;               // share of glass in the non-metallic part
    TextureId transmission_texture = -1;  // R
    TextureId normal_texture = -1;
    float normal_scale = 1;
    TextureId bump_texture = -1;
    float bump_scale = 1;

    Rgb emissive;  // radiance
    TextureId emissive_texture = -1;
    float base_alpha = 1, alpha_cutoff = 0.5f;
    TextureId alpha_texture = -1;

    // GGX alphas of an interface or a metal.
    float alpha_u = 0, alpha_v = 0;
    TextureId alpha_u_texture = -1, alpha_v_texture = -1;
    Rgb eta{1, 1, 1}, k;           // of conductors without a reflectance
    bool has_reflectance = false;  // base_color is the reflectance straight on instead
    float conductor_alpha_u = 0, conductor_alpha_v = 0;
    TextureId conductor_alpha_u_texture = -1, conductor_alpha_v_texture = -1;
    std::shared_ptr<const CoatTable> coat;

    float oren_nayar_a = 1, oren_nayar_b = 0;
    Rgb reflect{1, 1, 1};   // of dielectrics: tint of the reflection
    Rgb transmit{1, 1, 1};  // and of what goes through; of diffuse_transmission: its albedo
    TextureId reflect_texture = -1, transmit_texture = -1;
    Rgb absorption;  // per scene unit inside

    float specular = 1;
    Rgb specular_color{1, 1, 1};
    TextureId specular_texture = -1, specular_color_texture = -1;
    float clearcoat = 0, clearcoat_roughness = 0, clearcoat_normal_scale = 1;
    TextureId clearcoat_texture = -1, clearcoat_roughness_texture = -1;
    TextureId clearcoat_normal_texture = -1;
    Rgb sheen_color;
    float sheen_roughness = 0;
    TextureId sheen_color_texture = -1, sheen_roughness_texture = -1;

    int mix_a = -1, mix_b = -1;  // indices of materials
    float amount = 0.5f;         // share of b
    TextureId amount_texture = -1;

    bool IsEmissive() const { return emissive.x > 0 || emissive.y > 0 || emissive.z > 0; }
    // Light can come from behind the surface.
    bool Transmits() const {
        return has_glass || model == Model::kDielectric || model == Model::kThinDielectric ||
               model == Model::kDiffuseTransmission;
    }
    bool NeedsUv() const { return needs_uv; }
    // Sampling draws a number of its own for the lobe.
    bool Chooses() const {
        return has_glass || model == Model::kDielectric || model == Model::kThinDielectric ||
               model == Model::kDiffuseTransmission;
    }
    bool SeesThrough() const { return alpha_mode != AlphaMode::kOpaque; }
    // All that this material itself reads, -1 among them.
    std::array<TextureId, 21> Textures() const {
        return {base_color_texture,
                metallic_roughness_texture,
                transmission_texture,
                normal_texture,
                bump_texture,
                emissive_texture,
                alpha_texture,
                alpha_u_texture,
                alpha_v_texture,
                conductor_alpha_u_texture,
                conductor_alpha_v_texture,
                reflect_texture,
                transmit_texture,
                specular_texture,
                specular_color_texture,
                clearcoat_texture,
                clearcoat_roughness_texture,
                clearcoat_normal_texture,
                sheen_color_texture,
                sheen_roughness_texture,
                amount_texture};
    }
};

// value times what the texture gives.
inline Rgb Textured(Rgb value, TextureId texture, const TextureSet& textures, Vec2f uv) {
    if (texture < 0) {
        return value;
    }
    const Rgba t = textures.Lookup(texture, uv);
    return value * Rgb{t.r, t.g, t.b};
}
inline float Textured(float value, TextureId texture, const TextureSet& textures, Vec2f uv) {
    return texture < 0 ? value : value * textures.Lookup(texture, uv).r;
}

// Radiance that the front of the surface sends out at `uv`.
inline Rgb Emission(const CompiledMaterial& m, const TextureSet& textures, Vec2f uv) {
    return Textured(m.emissive, m.emissive_texture, textures, uv);
}

// Probability that a ray is stopped at `uv`: coverage (blend) or 0 and 1 (mask).
inline float Opacity(const CompiledMaterial& m, const TextureSet& textures, Vec2f uv) {
    float alpha = m.base_alpha;
    if (m.base_color_texture >= 0) {
        alpha *= textures.Lookup(m.base_color_texture, uv).a;
    }
    alpha = Textured(alpha, m.alpha_texture, textures, uv);
    return m.alpha_mode == AlphaMode::kMask ? (alpha >= m.alpha_cutoff ? 1.0f : 0.0f) : alpha;
}

}  // namespace relume::render
