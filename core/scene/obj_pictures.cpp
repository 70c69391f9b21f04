#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/scene/obj_materials.h"

// What can be decided only when the pictures are there.

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

bool IsDecoded(const SceneImage& image) { return !image.bytes.empty() || !image.floats.empty(); }

}  // namespace

// G is the one picture's, B the other's, in the larger one's size; without a picture: white.
void Materials::Pack(const Packed& packed, Scene* scene) const {
    const auto image_at = [&](int index) -> const SceneImage* {
        return index < 0 ? nullptr : &scene->images[static_cast<std::size_t>(index)];
    };
    const SceneImage *roughness = image_at(packed.roughness), *metallic = image_at(packed.metallic);
    SceneImage made;
    for (const SceneImage* image : {roughness, metallic}) {
        if (image != nullptr) {
            made.name += (made.name.empty() ? "" : " + ") + image->name;
            made.width = std::max(made.width, image->width);
            made.height = std::max(made.height, image->height);
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

void Materials::UseMatte(int texture, Scene* scene) const {
    Texture& use = scene->textures[static_cast<std::size_t>(texture)];
    const SceneImage& image = scene->images[static_cast<std::size_t>(use.image)];
    const int channels = image.channels;
    if (!IsDecoded(image) || (channels != 2 && channels != 4)) {
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
    for (const int texture : mattes_) {
        UseMatte(texture, scene);
    }
    for (const std::size_t index : bump_or_norm_) {
        Material& material = materials_[index];
        const int texture = material.params.GetInt("bump_texture", -1);
        const int image = scene->textures[static_cast<std::size_t>(texture)].image;
        if (IsNormalMap(scene->images[static_cast<std::size_t>(image)])) {
            ParamSet params;
            for (const auto& [name, value] : material.params.values()) {
                const std::string as = name == "bump_texture" ? "normal_texture"
                                       : name == "bump_scale" ? "normal_scale"
                                                              : name;
                std::visit([&](const auto& v) { params.Set(as, v); }, value);
            }
            material.params = std::move(params);
        }
    }
    // Pictures that only went into others keep their place but not their pixels.
    std::vector<bool> used(scene->images.size());
    for (const Texture& texture : scene->textures) {
        used[static_cast<std::size_t>(texture.image)] = true;
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
