#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/scene/obj_materials.h"

// The pictures of materials, and what can be decided only when they are there.

namespace relume::obj {
namespace {

// One channel at a pixel of a picture, as a byte; greys have it in all channels.
std::uint8_t ByteAt(const SceneImage& image, int x, int y, int channel) {
    const int c = image.channels >= 3 ? channel : 0;
    const auto index = (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                        static_cast<std::size_t>(x)) *
                           static_cast<std::size_t>(image.channels) +
                       static_cast<std::size_t>(c);
    return !image.bytes.empty() ? image.bytes[index]
                                : static_cast<std::uint8_t>(
                                      std::clamp(image.floats[index], 0.0f, 1.0f) * 255 + 0.5f);
}

// The parameters with the one of a name called otherwise, or left out.
ParamSet Renamed(const ParamSet& params, const std::map<std::string, std::string>& names) {
    ParamSet renamed;
    for (const auto& [name, value] : params.values()) {
        const auto it = names.find(name);
        const std::string& as = it == names.end() ? name : it->second;
        if (!as.empty()) {
            std::visit([&](const auto& v) { renamed.Set(as, v); }, value);
        }
    }
    return renamed;
}

bool IsDecoded(const SceneImage& image) { return !image.bytes.empty() || !image.floats.empty(); }

}  // namespace

int Materials::TextureOf(const MtlMaterial& from, const std::string& map, bool srgb) {
    const auto it = from.maps.find(map);
    if (it == from.maps.end()) {
        return -1;
    }
    const Map& m = it->second;
    const auto [known, is_new] = picture_of_.emplace(m.name, static_cast<int>(requests_.size()));
    if (is_new) {
        requests_.push_back({m.name, fmt::format("{}: {}", m.place.Text(), map), false, ""});
    }
    Texture texture;
    texture.image = known->second;
    texture.srgb = srgb;
    texture.wrap_u = texture.wrap_v = m.clamp ? WrapMode::kClamp : WrapMode::kRepeat;
    // From v up to v down, there and back.
    const float transform[6] = {m.scale.x, 0, m.offset.x, 0, m.scale.y, 1 - m.scale.y - m.offset.y};
    std::copy(std::begin(transform), std::end(transform), std::begin(texture.uv_transform));
    // Alpha's own texture, since its picture may be replaced.
    if (map == "map_d") {
        textures_.push_back(texture);
        return static_cast<int>(textures_.size()) - 1;
    }
    return Add(texture);
}

int Materials::Add(const Texture& texture) {
    const auto same = std::find(textures_.begin(), textures_.end(), texture);
    const auto position = static_cast<int>(same - textures_.begin());
    if (same == textures_.end()) {
        textures_.push_back(texture);
    }
    return position;
}

void Materials::SetTexture(const MtlMaterial& from, const std::string& map, const char* param,
                           bool srgb, Material* material) {
    const int texture = TextureOf(from, map, srgb);
    if (texture >= 0) {
        material->params.Set(param, static_cast<float>(texture));
    }
}

// G is the one picture's, B the other's, in the size of that of more pixels; without one: white.
void Materials::Pack(const Packed& packed, Scene* scene) const {
    const auto image_at = [&](int index) -> const SceneImage* {
        return index < 0 ? nullptr : &scene->images[static_cast<std::size_t>(index)];
    };
    const SceneImage *roughness = image_at(packed.roughness), *metallic = image_at(packed.metallic);
    SceneImage made;
    for (const SceneImage* image : {roughness, metallic}) {
        if (image != nullptr) {
            made.name += (made.name.empty() ? "" : " + ") + image->name;
            if (std::int64_t{image->width} * image->height >
                std::int64_t{made.width} * made.height) {
                made.width = image->width;
                made.height = image->height;
            }
        }
    }
    const SceneImage& any = roughness != nullptr ? *roughness : *metallic;
    if (IsDecoded(any)) {
        made.channels = 3;
        made.bytes.reserve(3 * static_cast<std::size_t>(made.width) *
                           static_cast<std::size_t>(made.height));
        for (int y = 0; y < made.height; ++y) {
            for (int x = 0; x < made.width; ++x) {
                const auto value = [&](const SceneImage* image, int channel) {
                    return image == nullptr
                               ? std::uint8_t{255}
                               : ByteAt(
                                     *image,
                                     static_cast<int>(std::int64_t{x} * image->width / made.width),
                                     static_cast<int>(std::int64_t{y} * image->height /
                                                      made.height),
                                     channel);
                };
                made.bytes.push_back(255);
                made.bytes.push_back(value(roughness, 1));
                made.bytes.push_back(value(metallic, 2));
            }
        }
    }
    scene->textures[static_cast<std::size_t>(packed.texture)].image =
        static_cast<int>(scene->images.size());
    scene->images.push_back(std::move(made));
}

void Materials::UseMatte(std::size_t material, Scene* scene) {
    ParamSet& params = materials_[material].params;
    const auto texture_of = [&](const char* name) -> Texture& {
        return scene->textures[static_cast<std::size_t>(params.GetInt(name, -1))];
    };
    Texture& use = texture_of("alpha_texture");
    const SceneImage& image = scene->images[static_cast<std::size_t>(use.image)];
    const int channels = image.channels;
    if (!IsDecoded(image) || (channels != 2 && channels != 4)) {
        return;
    }
    // The base colour's own fourth channel does it already.
    if (params.Has("base_color_texture") && texture_of("base_color_texture").image == use.image) {
        params = Renamed(params, {{"alpha_texture", ""}});
        return;
    }
    SceneImage matte;
    matte.name = image.name + ": alpha";
    matte.width = image.width;
    matte.height = image.height;
    matte.channels = 1;
    const auto step = static_cast<std::size_t>(channels);
    for (std::size_t i = step - 1; i < image.bytes.size(); i += step) {
        matte.bytes.push_back(image.bytes[i]);
    }
    for (std::size_t i = step - 1; i < image.floats.size(); i += step) {
        matte.floats.push_back(image.floats[i]);
    }
    use.image = static_cast<int>(scene->images.size());
    scene->images.push_back(std::move(matte));
}

// Exporters write normal maps as "bump", too: heights are grey, normals mostly blue.
bool Materials::IsNormalMap(const SceneImage& image) const {
    if (!IsDecoded(image) || image.channels < 3) {
        return false;
    }
    constexpr int kProbes = 64;  // each way
    int blue = 0;
    for (int j = 0; j < kProbes; ++j) {
        for (int i = 0; i < kProbes; ++i) {
            const int x = static_cast<int>(std::int64_t{i} * image.width / kProbes);
            const int y = static_cast<int>(std::int64_t{j} * image.height / kProbes);
            const int r = ByteAt(image, x, y, 0), g = ByteAt(image, x, y, 1),
                      b = ByteAt(image, x, y, 2);
            blue += b >= 128 && b > r + 16 && b > g + 16 ? 1 : 0;
        }
    }
    return blue > kProbes * kProbes / 2;
}

void Materials::Finish(const FileSource& files, bool decode, Scene* scene) {
    scene->images = LoadImages(files, requests_, decode);
    scene->textures = std::move(textures_);
    for (const Packed& packed : packed_) {
        Pack(packed, scene);
    }
    for (const std::size_t material : mattes_) {
        UseMatte(material, scene);
    }
    for (const std::size_t index : bump_or_norm_) {
        Material& material = materials_[index];
        const int texture = material.params.GetInt("bump_texture", -1);
        const int image = scene->textures[static_cast<std::size_t>(texture)].image;
        if (IsNormalMap(scene->images[static_cast<std::size_t>(image)])) {
            material.params = Renamed(material.params, {{"bump_texture", "normal_texture"},
                                                        {"bump_scale", "normal_scale"}});
        }
    }
    // Pictures that only went into others keep their place but not their pixels.
    std::vector<bool> used(scene->images.size());
    for (const Material& material : materials_) {
        for (const auto& [name, value] : material.params.values()) {
            if (name.ends_with("_texture")) {
                const int texture = material.params.GetInt(name, -1);
                const int image = scene->textures[static_cast<std::size_t>(texture)].image;
                used[static_cast<std::size_t>(image)] = true;
            }
        }
    }
    for (std::size_t i = 0; i < used.size(); ++i) {
        if (!used[i]) {
            scene->images[i].bytes.clear();
            scene->images[i].floats.clear();
        }
    }
    scene->materials = std::move(materials_);
}

}  // namespace relume::obj
