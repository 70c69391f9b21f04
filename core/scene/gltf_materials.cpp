#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "core/base/error.h"
#include "core/scene/gltf.h"
#include "core/scene/uri.h"

// glTF's metallic-roughness materials (section 3.9 and extensions) as parameters of
// "metallic_roughness" (scene.h). Factors that multiply a texture stay apart from it; the renderer
// multiplies.

namespace relume::gltf {
namespace {

using tinygltf::Value;

const Value* FindExtension(const tinygltf::ExtensionMap& extensions, const char* name) {
    const auto it = extensions.find(name);
    return it == extensions.end() || !it->second.IsObject() ? nullptr : &it->second;
}

double Number(const Value* object, const char* key, double otherwise) {
    if (object == nullptr || !object->Has(key) || !object->Get(key).IsNumber()) {
        return otherwise;
    }
    return object->Get(key).GetNumberAsDouble();
}

// Two numbers at `key`, e.g. an offset.
std::array<double, 2> Pair(const Value& object, const char* key, double otherwise) {
    std::array<double, 2> pair{otherwise, otherwise};
    if (object.Has(key) && object.Get(key).ArrayLen() == 2) {
        for (int i = 0; i < 2; ++i) {
            pair[static_cast<std::size_t>(i)] = object.Get(key).Get(i).GetNumberAsDouble();
        }
    }
    return pair;
}

WrapMode ToWrapMode(int wrap) {
    switch (wrap) {
        case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
            return WrapMode::kClamp;
        case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
            return WrapMode::kMirror;
        default:
            return WrapMode::kRepeat;
    }
}

// KHR_texture_transform: scale, then rotate, then move; v runs down.
void SetTransform(const Value& extension, Texture* texture) {
    const auto offset = Pair(extension, "offset", 0), scale = Pair(extension, "scale", 1);
    const double angle = Number(&extension, "rotation", 0);
    const double c = std::cos(angle), s = std::sin(angle);
    const double m[6] = {c * scale[0],  s * scale[1], offset[0],
                         -s * scale[0], c * scale[1], offset[1]};
    std::copy(std::begin(m), std::end(m), std::begin(texture->uv_transform));
}

bool SameTexture(const Texture& a, const Texture& b) {
    return a.image == b.image && a.srgb == b.srgb && a.nearest == b.nearest &&
           a.wrap_u == b.wrap_u && a.wrap_v == b.wrap_v &&
           std::equal(std::begin(a.uv_transform), std::end(a.uv_transform),
                      std::begin(b.uv_transform));
}

class MaterialReader {
  public:
    MaterialReader(const Document& document, Notes* notes) : document_(document), notes_(notes) {}

    Look Read(const Placed& placed) {
        for (const int index : Used(placed)) {
            look_.material_of[index] = static_cast<int>(look_.materials.size());
            look_.materials.push_back(index < 0 ? Default() : Convert(index));
        }
        if (look_.materials.empty()) {
            look_.materials.push_back(Default());
        }
        return std::move(look_);
    }

  private:
    static constexpr bool kSrgb = true, kLinear = false;

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
        SetBase(from, &material);
        SetEmission(from, &material);
        SetAlpha(from, &material);
        SetTransmission(from, &material);
        if (from.normalTexture.index >= 0) {
            material.params.Set("normal_scale", static_cast<float>(from.normalTexture.scale));
            SetTexture("normal_texture", from.normalTexture.index, from.normalTexture.texCoord,
                       FindExtension(from.normalTexture.extensions, "KHR_texture_transform"),
                       kLinear, &material);
        }
        if (from.occlusionTexture.index >= 0) {
            notes_->Add("occlusion textures are ignored: path tracing makes its own occlusion");
        }
        if (from.doubleSided) {
            material.params.Set("double_sided", true);
        }
        return material;
    }

    void SetBase(const tinygltf::Material& from, Material* material) {
        const auto& pbr = from.pbrMetallicRoughness;
        const auto& base = pbr.baseColorFactor;
        material->params.Set("base_color", std::vector<float>{static_cast<float>(base[0]),
                                                              static_cast<float>(base[1]),
                                                              static_cast<float>(base[2])});
        if (base[3] != 1 && from.alphaMode != "OPAQUE") {
            material->params.Set("base_alpha", static_cast<float>(base[3]));
        }
        material->params.Set("metallic", static_cast<float>(pbr.metallicFactor));
        material->params.Set("roughness", static_cast<float>(pbr.roughnessFactor));
        SetTexture("base_color_texture", pbr.baseColorTexture, kSrgb, material);
        SetTexture("metallic_roughness_texture", pbr.metallicRoughnessTexture, kLinear, material);
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
            SetTexture("emissive_texture", from.emissiveTexture, kSrgb, material);
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

    // KHR_materials_transmission, _ior, _volume. A volume makes it a solid body: rays bend.
    void SetTransmission(const tinygltf::Material& from, Material* material) {
        const double ior = Number(FindExtension(from.extensions, "KHR_materials_ior"), "ior", 1.5);
        if (ior != 1.5) {
            // 0 means "reflect as at infinite ior", for other workflows.
            if (!(ior >= 1)) {
                notes_->Add(fmt::format("{}: an ior of {} is taken as 1.5", material->source, ior));
            } else {
                material->params.Set("ior", static_cast<float>(ior));
            }
        }
        const Value* transmission = FindExtension(from.extensions, "KHR_materials_transmission");
        const double factor = Number(transmission, "transmissionFactor", 0);
        if (!(factor > 0)) {
            return;
        }
        material->params.Set("transmission", static_cast<float>(factor));
        if (transmission->Has("transmissionTexture")) {
            const Value& info = transmission->Get("transmissionTexture");
            const Value* transform = nullptr;
            if (info.Has("extensions") && info.Get("extensions").Has("KHR_texture_transform")) {
                transform = &info.Get("extensions").Get("KHR_texture_transform");
            }
            SetTexture("transmission_texture", static_cast<int>(Number(&info, "index", -1)),
                       static_cast<int>(Number(&info, "texCoord", 0)), transform, kLinear,
                       material);
        }
        const Value* volume = FindExtension(from.extensions, "KHR_materials_volume");
        if (Number(volume, "thicknessFactor", 0) > 0) {
            material->params.Set("thin", false);
            if (volume->Has("attenuationDistance") || volume->Has("attenuationColor")) {
                notes_->Add("KHR_materials_volume: attenuation inside of glass is ignored");
            }
        }
    }

    void SetTexture(const char* param, const tinygltf::TextureInfo& info, bool srgb,
                    Material* material) {
        SetTexture(param, info.index, info.texCoord,
                   FindExtension(info.extensions, "KHR_texture_transform"), srgb, material);
    }

    void SetTexture(const char* param, int index, int tex_coord, const Value* transform, bool srgb,
                    Material* material) {
        if (index < 0) {
            return;
        }
        const SourceLocation wanted_by = fmt::format("{}: {}", material->source, param);
        const auto& from = At(document_.model.textures, index, wanted_by, "texture");
        if (from.source < 0) {
            Fail(wanted_by,
                 fmt::format("texture {} has no picture that can be read (an extension's format?); "
                             "export the scene with PNG or JPEG textures",
                             index));
        }
        Texture texture;
        texture.srgb = srgb;
        texture.image = PictureIndex(from.source, wanted_by);
        if (from.sampler >= 0) {
            const auto& sampler = At(document_.model.samplers, from.sampler, wanted_by, "sampler");
            texture.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
            texture.wrap_u = ToWrapMode(sampler.wrapS);
            texture.wrap_v = ToWrapMode(sampler.wrapT);
        }
        if (transform != nullptr) {
            SetTransform(*transform, &texture);
            tex_coord = static_cast<int>(Number(transform, "texCoord", tex_coord));
        }
        if (tex_coord != 0) {
            notes_->Add(fmt::format("{} uses TEXCOORD_{}: TEXCOORD_0 is taken instead", wanted_by,
                                    tex_coord));
        }
        const auto same =
            std::find_if(look_.textures.begin(), look_.textures.end(),
                         [&](const Texture& other) { return SameTexture(texture, other); });
        const auto position = same - look_.textures.begin();
        if (same == look_.textures.end()) {
            look_.textures.push_back(texture);
        }
        material->params.Set(param, static_cast<float>(position));
    }

    // Pictures are told apart by what they are read from: some exporters list a file many times.
    int PictureIndex(int image, const SourceLocation& wanted_by) {
        const auto& from = At(document_.images, image, wanted_by, "image");
        const auto key = std::make_pair(from.uri, from.uri.empty() ? from.buffer_view : -1);
        const auto [it, is_new] = picture_of_.emplace(key, static_cast<int>(look_.pictures.size()));
        if (is_new) {
            look_.pictures.push_back(
                {image,
                 fmt::format("{} ({})", wanted_by,
                             from.name.empty() ? fmt::format("image {}", image)
                                               : fmt::format("image {} '{}'", image, from.name))});
        }
        return it->second;
    }

    const Document& document_;
    Notes* notes_;
    Look look_;
    std::map<std::pair<std::string, int>, int> picture_of_;
};

}  // namespace

Look ReadMaterials(const Document& document, const Placed& placed, Notes* notes) {
    return MaterialReader(document, notes).Read(placed);
}

}  // namespace relume::gltf
