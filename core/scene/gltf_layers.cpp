#include <algorithm>
#include <cmath>

#include "core/scene/gltf_textures.h"

// KHR_materials_transmission, _ior, _volume, _specular, _clearcoat and _sheen.

namespace relume::gltf {
namespace {

using tinygltf::Value;

// A factor that a texture may scale.
void SetNumber(const Value& extension, const char* key, float otherwise, const char* param,
               Material* material) {
    const auto value = static_cast<float>(Number(&extension, key, otherwise));
    if (value != otherwise) {
        material->params.Set(param, value);
    }
}

void ReadIor(const tinygltf::Material& from, Material* material, Notes* notes) {
    const double ior = Number(FindExtension(from.extensions, "KHR_materials_ior"), "ior", 1.5);
    if (ior == 1.5) {
        return;
    }
    // 0 means "reflect as at infinite ior", for other workflows.
    if (!(ior >= 1)) {
        notes->Add(fmt::format("{}: an ior of {} is taken as 1.5", material->source, ior));
    } else {
        material->params.Set("ior", static_cast<float>(ior));
    }
}

// Thickness says only that there is an inside: rays find how thick it is. The distance is in world
// space, whatever the node's scale: after it, white light has the attenuation colour.
void ReadVolume(const tinygltf::Material& from, Material* material) {
    const Value* volume = FindExtension(from.extensions, "KHR_materials_volume");
    if (!(Number(volume, "thicknessFactor", 0) > 0)) {
        return;
    }
    material->params.Set("thin", false);
    constexpr float kDarkest = 1e-6f;  // black would be an infinite density
    const double distance = Number(volume, "attenuationDistance", 0);
    std::vector<float> absorption = Color(volume, "attenuationColor", {1, 1, 1});
    bool absorbs = false;
    for (float& channel : absorption) {
        channel = distance > 0 ? -std::log(std::clamp(channel, kDarkest, 1.0f)) /
                                     static_cast<float>(distance)
                               : 0;
        absorbs = absorbs || channel > 0;
    }
    if (absorbs) {
        material->params.Set("absorption", absorption);
    }
}

void ReadTransmission(const tinygltf::Material& from, TextureReader* textures, Material* material) {
    const Value* extension = FindExtension(from.extensions, "KHR_materials_transmission");
    if (Number(extension, "transmissionFactor", 0) > 0) {
        SetNumber(*extension, "transmissionFactor", 0, "transmission", material);
        textures->Set("transmission_texture", *extension, "transmissionTexture", kLinear, material);
        ReadVolume(from, material);
    }
}

void ReadSpecular(const tinygltf::Material& from, TextureReader* textures, Material* material) {
    const Value* extension = FindExtension(from.extensions, "KHR_materials_specular");
    if (extension == nullptr) {
        return;
    }
    SetNumber(*extension, "specularFactor", 1, "specular", material);
    textures->Set("specular_texture", *extension, "specularTexture", kLinear, material);
    const std::vector<float> white{1, 1, 1};
    const std::vector<float> color = Color(extension, "specularColorFactor", white);
    if (color != white) {
        material->params.Set("specular_color", color);
    }
    textures->Set("specular_color_texture", *extension, "specularColorTexture", kSrgb, material);
}

void ReadClearcoat(const tinygltf::Material& from, TextureReader* textures, Material* material) {
    const Value* extension = FindExtension(from.extensions, "KHR_materials_clearcoat");
    if (!(Number(extension, "clearcoatFactor", 0) > 0)) {
        return;
    }
    SetNumber(*extension, "clearcoatFactor", 0, "clearcoat", material);
    textures->Set("clearcoat_texture", *extension, "clearcoatTexture", kLinear, material);
    SetNumber(*extension, "clearcoatRoughnessFactor", 0, "clearcoat_roughness", material);
    textures->Set("clearcoat_roughness_texture", *extension, "clearcoatRoughnessTexture", kLinear,
                  material);
    textures->Set("clearcoat_normal_texture", *extension, "clearcoatNormalTexture", kLinear,
                  material);
    if (material->params.Has("clearcoat_normal_texture")) {
        SetNumber(extension->Get("clearcoatNormalTexture"), "scale", 1, "clearcoat_normal_scale",
                  material);
    }
}

void ReadSheen(const tinygltf::Material& from, TextureReader* textures, Material* material) {
    const Value* extension = FindExtension(from.extensions, "KHR_materials_sheen");
    const std::vector<float> color = Color(extension, "sheenColorFactor", {0, 0, 0});
    if (!(color[0] > 0 || color[1] > 0 || color[2] > 0)) {
        return;
    }
    material->params.Set("sheen_color", color);
    textures->Set("sheen_color_texture", *extension, "sheenColorTexture", kSrgb, material);
    SetNumber(*extension, "sheenRoughnessFactor", 0, "sheen_roughness", material);
    textures->Set("sheen_roughness_texture", *extension, "sheenRoughnessTexture", kLinear,
                  material);
}

}  // namespace

void ReadLayers(const tinygltf::Material& from, TextureReader* textures, Material* material,
                Notes* notes) {
    ReadIor(from, material, notes);
    ReadTransmission(from, textures, material);
    ReadSpecular(from, textures, material);
    ReadClearcoat(from, textures, material);
    ReadSheen(from, textures, material);
}

}  // namespace relume::gltf
