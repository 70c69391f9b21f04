#include "core/scene/gltf_textures.h"

#include <algorithm>
#include <array>
#include <cmath>

// Textures (section 3.8) and KHR_texture_transform. A mesh has one set of texture coordinates here:
// that of its material's first texture.

namespace relume::gltf {
namespace {

using tinygltf::Value;

constexpr const char* kTransform = "KHR_texture_transform";

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

// Scale, then rotate, then move; v runs down.
void SetTransform(const Value& extension, Texture* texture) {
    const auto offset = Pair(extension, "offset", 0), scale = Pair(extension, "scale", 1);
    const double angle = Number(&extension, "rotation", 0);
    const double c = std::cos(angle), s = std::sin(angle);
    const double m[6] = {c * scale[0],  s * scale[1], offset[0],
                         -s * scale[0], c * scale[1], offset[1]};
    std::copy(std::begin(m), std::end(m), std::begin(texture->uv_transform));
}

}  // namespace

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

std::vector<float> Color(const Value* object, const char* key,
                         const std::vector<float>& otherwise) {
    if (object == nullptr || !object->Has(key) || object->Get(key).ArrayLen() != 3) {
        return otherwise;
    }
    std::vector<float> color;
    for (int i = 0; i < 3; ++i) {
        color.push_back(static_cast<float>(object->Get(key).Get(i).GetNumberAsDouble()));
    }
    return color;
}

void TextureReader::Begin() { uses_.clear(); }

int TextureReader::End(const Material& material) {
    if (uses_.empty()) {
        return 0;
    }
    const Use& first = uses_.front();
    for (const Use& use : uses_) {
        if (use.set != first.set) {
            notes_->Add(fmt::format(
                "{}: {} uses TEXCOORD_{} but {} uses TEXCOORD_{}: the latter is taken for both",
                material.source, use.param, use.set, first.param, first.set));
        }
    }
    return first.set;
}

void TextureReader::Set(const char* param, const tinygltf::TextureInfo& info, bool srgb,
                        Material* material) {
    Add(param, info.index, info.texCoord, FindExtension(info.extensions, kTransform), srgb,
        material);
}

void TextureReader::SetNormal(const tinygltf::NormalTextureInfo& info, Material* material) {
    if (info.index >= 0) {
        material->params.Set("normal_scale", static_cast<float>(info.scale));
        Add("normal_texture", info.index, info.texCoord, FindExtension(info.extensions, kTransform),
            kLinear, material);
    }
}

void TextureReader::Set(const char* param, const Value& extension, const char* key, bool srgb,
                        Material* material) {
    if (!extension.Has(key) || !extension.Get(key).IsObject()) {
        return;
    }
    const Value& info = extension.Get(key);
    const Value* transform = nullptr;
    if (info.Has("extensions") && info.Get("extensions").Has(kTransform)) {
        transform = &info.Get("extensions").Get(kTransform);
    }
    Add(param, static_cast<int>(Number(&info, "index", -1)),
        static_cast<int>(Number(&info, "texCoord", 0)), transform, srgb, material);
}

void TextureReader::Add(const char* param, int index, int tex_coord, const Value* transform,
                        bool srgb, Material* material) {
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
    uses_.push_back({param, tex_coord});
    const auto same = std::find(look_->textures.begin(), look_->textures.end(), texture);
    const auto position = same - look_->textures.begin();
    if (same == look_->textures.end()) {
        look_->textures.push_back(texture);
    }
    material->params.Set(param, static_cast<float>(position));
}

// Pictures are told apart by what they are read from: some exporters list a file many times.
int TextureReader::PictureIndex(int image, const SourceLocation& wanted_by) {
    const auto& from = At(document_.images, image, wanted_by, "image");
    const auto key = std::make_pair(from.uri, from.uri.empty() ? from.buffer_view : -1);
    const auto [it, is_new] = picture_of_.emplace(key, static_cast<int>(look_->pictures.size()));
    if (is_new) {
        look_->pictures.push_back(
            {image,
             fmt::format("{} ({})", wanted_by,
                         from.name.empty() ? fmt::format("image {}", image)
                                           : fmt::format("image {} '{}'", image, from.name))});
    }
    return it->second;
}

}  // namespace relume::gltf
