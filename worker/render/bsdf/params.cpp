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

void ReadSurfaceParams(const ParamSet& params, const Scene& scene, CompiledMaterial* material) {
    material->base_color = ReadColor(params, "base_color", {1, 1, 1});
    material->base_color_texture = ReadTexture(params, "base_color_texture", scene);
    material->base_alpha = ReadInRange(params, "base_alpha", 1, 0, 1);
    material->emissive = ReadColor(params, "emissive", {0, 0, 0});
    material->emissive_texture = ReadTexture(params, "emissive_texture", scene);
    material->normal_texture = ReadTexture(params, "normal_texture", scene);
    material->normal_scale = params.GetFloat("normal_scale", 1);
    const std::string mode = params.GetChoice("alpha_mode", "opaque", {"opaque", "mask", "blend"});
    material->alpha_mode = mode == "mask"    ? AlphaMode::kMask
                           : mode == "blend" ? AlphaMode::kBlend
                                             : AlphaMode::kOpaque;
    material->alpha_cutoff = params.GetFloat("alpha_cutoff", 0.5f);
    material->double_sided = params.GetBool("double_sided", false);
    // A surface that can't be seen through anywhere costs no filter.
    const bool textured = material->base_color_texture >= 0;
    if (!textured && ((material->alpha_mode == AlphaMode::kBlend && material->base_alpha == 1) ||
                      (material->alpha_mode == AlphaMode::kMask &&
                       material->base_alpha >= material->alpha_cutoff))) {
        material->alpha_mode = AlphaMode::kOpaque;
    }
}

}  // namespace relume::render
