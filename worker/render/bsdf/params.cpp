#include "worker/render/bsdf/params.h"

#include <fmt/format.h>

#include "core/base/error.h"

namespace relume::render {

TextureId ReadTexture(const ParamSet& params, const std::string& name, const Scene& scene) {
    const int index = params.GetInt(name, -1);
    if (!params.Has(name)) {
        return -1;
    }
    if (index < 0 || static_cast<std::size_t>(index) >= scene.textures.size()) {
        ThrowInvalidArgument(fmt::format("{} refers to texture {}, but there are {}", name, index,
                                         scene.textures.size()));
    }
    const int image = scene.textures[static_cast<std::size_t>(index)].image;
    if (image < 0 || static_cast<std::size_t>(image) >= scene.images.size()) {
        ThrowInvalidArgument(fmt::format("{}: texture {} refers to image {}, but there are {}",
                                         name, index, image, scene.images.size()));
    }
    return index;
}

Rgb ReadColor(const ParamSet& params, const std::string& name, Rgb otherwise) {
    const std::vector<float> v = params.GetFloats(name, {otherwise.x, otherwise.y, otherwise.z});
    if (v.size() != 3) {
        ThrowInvalidArgument(fmt::format("parameter '{}' must be 3 numbers", name));
    }
    for (const float c : v) {
        if (!(c >= 0) || !std::isfinite(c)) {
            ThrowInvalidArgument(fmt::format("parameter '{}' must not be negative", name));
        }
    }
    return {v[0], v[1], v[2]};
}

float ReadInRange(const ParamSet& params, const std::string& name, float otherwise, float low,
                  float high) {
    const float value = params.GetFloat(name, otherwise);
    if (!(value >= low && value <= high)) {
        ThrowInvalidArgument(
            fmt::format("parameter '{}' is {}, it must be from {} to {}", name, value, low, high));
    }
    return value;
}

void ReadSurfaceParams(const ParamSet& params, const Scene& scene, CompiledMaterial* m) {
    m->emissive = ReadColor(params, "emissive", {0, 0, 0});
    m->emissive_texture = ReadTexture(params, "emissive_texture", scene);
    m->normal_texture = ReadTexture(params, "normal_texture", scene);
    m->normal_scale = params.GetFloat("normal_scale", 1);
    m->bump_texture = ReadTexture(params, "bump_texture", scene);
    m->bump_scale = params.GetFloat("bump_scale", 1);
    m->base_alpha = ReadInRange(params, "alpha", 1, 0, 1);
    m->alpha_texture = ReadTexture(params, "alpha_texture", scene);
    const std::string mode = params.GetChoice("alpha_mode", "opaque", {"opaque", "mask", "blend"});
    m->alpha_mode = mode == "mask"    ? AlphaMode::kMask
                    : mode == "blend" ? AlphaMode::kBlend
                                      : AlphaMode::kOpaque;
    m->alpha_cutoff = params.GetFloat("alpha_cutoff", 0.5f);
    m->double_sided = params.GetBool("double_sided", false);
}

void ReadBaseColor(const ParamSet& params, const Scene& scene, CompiledMaterial* m) {
    m->base_color = ReadColor(params, "base_color", {1, 1, 1});
    m->base_color_texture = ReadTexture(params, "base_color_texture", scene);
    m->base_alpha *= ReadInRange(params, "base_alpha", 1, 0, 1);
}

void ReadAlphas(const ParamSet& params, float otherwise, const Scene& scene, CompiledMaterial* m) {
    m->alpha_u = ReadInRange(params, "alpha_u", otherwise, 0, 1);
    m->alpha_v =
        ReadInRange(params, "alpha_v", params.Has("alpha_u") ? m->alpha_u : otherwise, 0, 1);
    m->alpha_u_texture = ReadTexture(params, "alpha_u_texture", scene);
    m->alpha_v_texture = ReadTexture(params, "alpha_v_texture", scene);
}

void ReadAbsorption(const ParamSet& params, CompiledMaterial* m) {
    m->absorption = ReadColor(params, "absorption", {0, 0, 0});
    m->absorbs = MaxComponent(m->absorption) > 0;
}

namespace {

bool IsAnisotropic(const CompiledMaterial& m) {
    return m.alpha_u != m.alpha_v || m.alpha_u_texture != m.alpha_v_texture ||
           m.conductor_alpha_u != m.conductor_alpha_v ||
           m.conductor_alpha_u_texture != m.conductor_alpha_v_texture;
}

enum class Visit : std::uint8_t { kNot, kOpen, kDone };

void Finish(const Scene& scene, std::size_t index, std::vector<CompiledMaterial>* materials,
            std::vector<Visit>* visits) {
    CompiledMaterial& m = (*materials)[index];
    (*visits)[index] = Visit::kOpen;
    for (const TextureId id : m.Textures()) {
        m.needs_uv = m.needs_uv || id >= 0;
    }
    m.anisotropic = IsAnisotropic(m);
    m.needs_tangents = m.normal_texture >= 0 || m.clearcoat_normal_texture >= 0 || m.anisotropic;
    // A surface that can't be seen through anywhere costs no filter.
    const bool textured = m.base_color_texture >= 0 || m.alpha_texture >= 0;
    if (!textured && ((m.alpha_mode == AlphaMode::kBlend && m.base_alpha == 1) ||
                      (m.alpha_mode == AlphaMode::kMask && m.base_alpha >= m.alpha_cutoff))) {
        m.alpha_mode = AlphaMode::kOpaque;
    }
    if (m.model == Model::kMix) {
        for (const int part : {m.mix_a, m.mix_b}) {
            const std::string& place = scene.materials[index].source;
            if (part < 0 || static_cast<std::size_t>(part) >= materials->size()) {
                ThrowInvalidArgument(
                    fmt::format("{}: a mix refers to material {}, but there are {}", place, part,
                                materials->size()));
            }
            const std::size_t p = static_cast<std::size_t>(part);
            if ((*visits)[p] == Visit::kOpen) {
                ThrowInvalidArgument(fmt::format("{}: a mix contains itself", place));
            }
            if ((*visits)[p] == Visit::kNot) {
                Finish(scene, p, materials, visits);
            }
            m.needs_uv = m.needs_uv || (*materials)[p].needs_uv;
            m.needs_tangents = m.needs_tangents || (*materials)[p].needs_tangents;
            m.anisotropic = m.anisotropic || (*materials)[p].anisotropic;
        }
    }
    (*visits)[index] = Visit::kDone;
}

}  // namespace

void FinishMaterials(const Scene& scene, std::vector<CompiledMaterial>* materials) {
    std::vector<Visit> visits(materials->size(), Visit::kNot);
    for (std::size_t i = 0; i < materials->size(); ++i) {
        if (visits[i] == Visit::kNot) {
            Finish(scene, i, materials, &visits);
        }
    }
}

}  // namespace relume::render
