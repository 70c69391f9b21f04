#pragma once

#include <cstdint>

#include "core/math/vec.h"
#include "worker/render/texture/texture_set.h"

namespace relume::render {

enum class AlphaMode : std::uint8_t { kOpaque, kMask, kBlend };

// A material with its parameters read, for all types: plain data that shading switches on. A type
// is a way to fill it (registry.cpp).
struct CompiledMaterial {
    // Layers that exist at all.
    bool has_opaque = true;     // diffuse and reflection
    bool has_specular = false;  // GGX reflection on the opaque part
    bool has_glass = false;     // transmission

    Rgb base_color{1, 1, 1};
    float base_alpha = 1;
    float metallic = 0;
    float roughness = 1;
    float ior = 1.5f;
    float transmission = 0;  // share of glass in the non-metallic part
    bool thin = true;        // glass without a volume behind it
    Rgb emissive;            // radiance
    float normal_scale = 1;
    float alpha_cutoff = 0.5f;
    AlphaMode alpha_mode = AlphaMode::kOpaque;
    bool double_sided = false;

    TextureId base_color_texture = -1;
    TextureId metallic_roughness_texture = -1;  // G roughness, B metallic
    TextureId normal_texture = -1;
    TextureId emissive_texture = -1;
    TextureId transmission_texture = -1;  // R

    bool IsEmissive() const { return emissive.x > 0 || emissive.y > 0 || emissive.z > 0; }
    bool NeedsUv() const {
        return base_color_texture >= 0 || metallic_roughness_texture >= 0 || normal_texture >= 0 ||
               emissive_texture >= 0 || transmission_texture >= 0;
    }
    bool SeesThrough() const { return alpha_mode != AlphaMode::kOpaque; }
};

// Radiance that the front of the surface sends out at `uv`.
inline Rgb Emission(const CompiledMaterial& m, const TextureSet& textures, Vec2f uv) {
    if (m.emissive_texture < 0) {
        return m.emissive;
    }
    const Rgba t = textures.Lookup(m.emissive_texture, uv);
    return m.emissive * Rgb{t.r, t.g, t.b};
}

// Probability that a ray is stopped at `uv`: coverage (blend) or 0 and 1 (mask).
inline float Opacity(const CompiledMaterial& m, const TextureSet& textures, Vec2f uv) {
    float alpha = m.base_alpha;
    if (m.base_color_texture >= 0) {
        alpha *= textures.Lookup(m.base_color_texture, uv).a;
    }
    return m.alpha_mode == AlphaMode::kMask ? (alpha >= m.alpha_cutoff ? 1.0f : 0.0f) : alpha;
}

}  // namespace relume::render
