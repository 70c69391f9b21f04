#include <algorithm>
#include <set>
#include <utility>

#include "core/scene/gltf_textures.h"

// glTF's metallic-roughness materials (section 3.9) as parameters of "metallic_roughness"
// (scene.h); their extensions are read in gltf_layers.cpp. Factors that multiply a texture stay
// apart from it; the renderer multiplies. KHR_materials_unlit becomes a black surface that shines
// from both sides with the base colour as its radiance: it looks the same in any light, but lights
// what is around it.

namespace relume::gltf {
namespace {

class MaterialReader {
  public:
    MaterialReader(const Document& document, Notes* notes)
        : document_(document), notes_(notes), textures_(document, notes, &look_) {}

    Look Read(const Placed& placed) {
        for (const int index : Used(placed)) {
            look_.material_of[index] = static_cast<int>(look_.materials.size());
            textures_.Begin();
            look_.materials.push_back(index < 0 ? Default() : Convert(index));
            look_.uv_sets.push_back(textures_.End(look_.materials.back()));
        }
        if (look_.materials.empty()) {
            look_.materials.push_back(Default());
            look_.uv_sets.push_back(0);
        }
        return std::move(look_);
    }

  private:
    std::set<int> Used(const Placed& placed) const {
        std::set<int> used;
        for (const auto& use : placed.meshes) {
            const auto index = static_cast<std::size_t>(use.mesh);
            for (const auto& primitive : document_.model.meshes[index].primitives) {
                if (primitive.material >= 0) {
                    At(document_.model.materials, primitive.material,
                       document_.Place("mesh", index, document_.model.meshes[index].name),
                       "material");
                }
                used.insert(std::max(primitive.material, -1));
            }
        }
        return used;
    }

    Material Default() const {
        Material material;
        material.name = "default";
        material.type = "metallic_roughness";
        material.source = document_.name + ": default material";
        return material;
    }

    Material Convert(int index) {
        const auto& from = document_.model.materials[static_cast<std::size_t>(index)];
        Material material;
        material.name = from.name;
        material.type = "metallic_roughness";
        material.source = document_.Place("material", static_cast<std::size_t>(index), from.name);
        SetAlpha(from, &material);
        if (from.extensions.count("KHR_materials_unlit") != 0) {
            SetUnlit(from, &material);
            return material;
        }
        SetBase(from, &material);
        SetEmission(from, &material);
        ReadLayers(from, &textures_, &material, notes_);
        textures_.SetNormal(from.normalTexture, &material);
        // Occlusion textures are for renderers that don't trace it.
        if (from.doubleSided) {
            material.params.Set("double_sided", true);
        }
        return material;
    }

    void SetUnlit(const tinygltf::Material& from, Material* material) {
        const auto& pbr = from.pbrMetallicRoughness;
        const auto& base = pbr.baseColorFactor;
        material->type = "diffuse";
        material->params.Set("base_color", std::vector<float>{0, 0, 0});
        material->params.Set("emissive", std::vector<float>(base.begin(), base.begin() + 3));
        material->params.Set("double_sided", true);
        textures_.Set("emissive_texture", pbr.baseColorTexture, kSrgb, material);
        if (from.alphaMode != "OPAQUE") {
            textures_.Set("base_color_texture", pbr.baseColorTexture, kSrgb, material);
            if (base[3] != 1) {
                material->params.Set("alpha", static_cast<float>(base[3]));
            }
        }
    }

    void SetBase(const tinygltf::Material& from, Material* material) {
        const auto& pbr = from.pbrMetallicRoughness;
        const auto& base = pbr.baseColorFactor;
        material->params.Set("base_color", std::vector<float>(base.begin(), base.begin() + 3));
        if (base[3] != 1 && from.alphaMode != "OPAQUE") {
            material->params.Set("base_alpha", static_cast<float>(base[3]));
        }
        material->params.Set("metallic", static_cast<float>(pbr.metallicFactor));
        material->params.Set("roughness", static_cast<float>(pbr.roughnessFactor));
        textures_.Set("base_color_texture", pbr.baseColorTexture, kSrgb, material);
        textures_.Set("metallic_roughness_texture", pbr.metallicRoughnessTexture, kLinear,
                      material);
    }

    void SetEmission(const tinygltf::Material& from, Material* material) {
        std::vector<float> emissive(from.emissiveFactor.begin(), from.emissiveFactor.end());
        const double strength =
            Number(FindExtension(from.extensions, "KHR_materials_emissive_strength"),
                   "emissiveStrength", 1);
        for (float& e : emissive) {
            e *= static_cast<float>(strength);
        }
        if (emissive.size() == 3 && (emissive[0] > 0 || emissive[1] > 0 || emissive[2] > 0)) {
            material->params.Set("emissive", emissive);
            textures_.Set("emissive_texture", from.emissiveTexture, kSrgb, material);
        }
    }

    void SetAlpha(const tinygltf::Material& from, Material* material) {
        if (from.alphaMode == "MASK") {
            material->params.Set("alpha_mode", "mask");
            material->params.Set("alpha_cutoff", static_cast<float>(from.alphaCutoff));
        } else if (from.alphaMode == "BLEND") {
            material->params.Set("alpha_mode", "blend");
        } else if (from.alphaMode != "OPAQUE") {
            Fail(material->source,
                 fmt::format("alphaMode '{}' is not known; correct the material", from.alphaMode));
        }
    }

    const Document& document_;
    Notes* notes_;
    Look look_;
    TextureReader textures_;
};

}  // namespace

Look ReadMaterials(const Document& document, const Placed& placed, Notes* notes) {
    return MaterialReader(document, notes).Read(placed);
}

}  // namespace relume::gltf
