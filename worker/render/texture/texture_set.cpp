#include "worker/render/texture/texture_set.h"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>

#include "core/base/error.h"
#include "core/base/parallel.h"

namespace relume::render {
namespace {

constexpr std::size_t kLine = 64;
constexpr std::size_t kHugePage = std::size_t{2} << 20;

void* AllocateAligned(std::size_t bytes) {
    // Large pictures ask for huge pages: lookups are scattered, and each would miss the TLB.
    const std::size_t alignment = bytes >= kHugePage ? kHugePage : kLine;
    const std::size_t size = (bytes + alignment - 1) / alignment * alignment;
    void* p = std::aligned_alloc(alignment, size);
    if (p == nullptr) {
        throw std::bad_alloc();
    }
    if (alignment == kHugePage) {
        madvise(p, size, MADV_HUGEPAGE);  // a wish: refusal costs speed only
    }
    return p;
}

// Interleaved values of 1 to 4 channels as RGBA; `full` is an opaque alpha.
template <class T>
void ExpandTexel(const T* in, int channels, T full, T* out) {
    out[0] = in[0];
    out[1] = channels >= 3 ? in[1] : in[0];
    out[2] = channels >= 3 ? in[2] : in[0];
    out[3] = channels == 4 ? in[3] : channels == 2 ? in[1] : full;
}

bool IsUniform(const SceneImage& image) {
    const std::size_t c = static_cast<std::size_t>(image.channels);
    return image.bytes.size() > c &&
           std::memcmp(image.bytes.data(), image.bytes.data() + c, image.bytes.size() - c) == 0;
}

void RequirePixels(const SceneImage& image) {
    const std::size_t values = static_cast<std::size_t>(image.width) *
                               static_cast<std::size_t>(image.height) *
                               static_cast<std::size_t>(image.channels);
    if (values == 0 || std::max(image.bytes.size(), image.floats.size()) < values) {
        ThrowInvalidArgument(fmt::format(
            "{}: the picture has no pixels; load the scene with its images", image.name));
    }
}

void Free(SceneImage* image) { std::vector<std::uint8_t>().swap(image->bytes); }

void SetAddressing(const Texture& texture, TextureView* view) {
    view->srgb = texture.srgb;
    view->nearest = texture.nearest;
    view->wrap_u = texture.wrap_u;
    view->wrap_v = texture.wrap_v;
    std::copy(texture.uv_transform, texture.uv_transform + 6, view->m);
    const float identity[6] = {1, 0, 0, 0, 1, 0};
    view->transformed = !std::equal(view->m, view->m + 6, identity);
}

void FillPicture(const SceneImage& image, const TextureView& picture) {
    const std::size_t channels = static_cast<std::size_t>(image.channels);
    auto* bytes = const_cast<std::uint8_t*>(picture.bytes);
    auto* floats = const_cast<Rgba*>(picture.floats);
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            const std::size_t from =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                static_cast<std::size_t>(x);
            if (floats != nullptr) {
                ExpandTexel(image.floats.data() + from * channels, image.channels, 1.0f,
                            &floats[from].r);
                continue;
            }
            const std::size_t block =
                static_cast<std::size_t>((y >> 2) * picture.blocks_per_row + (x >> 2));
            const std::size_t to = block * 16 + static_cast<std::size_t>((y & 3) * 4 + (x & 3));
            ExpandTexel<std::uint8_t>(image.bytes.data() + from * channels, image.channels, 255,
                                      bytes + to * 4);
        }
    }
}

void FillPack(const Scene& scene, const TexturePack& pack, const TextureView& view) {
    const auto picture = [&](TextureId id) -> const SceneImage* {
        return id < 0 ? nullptr
                      : &scene.images[static_cast<std::size_t>(
                            scene.textures[static_cast<std::size_t>(id)].image)];
    };
    const SceneImage* base = picture(pack.base);
    const SceneImage* normal = picture(pack.normal);
    const SceneImage* surface = picture(pack.metallic_roughness);
    const auto read = [](const SceneImage* image, std::size_t from, std::uint8_t* out) {
        if (image != nullptr) {
            ExpandTexel<std::uint8_t>(
                image->bytes.data() + from * static_cast<std::size_t>(image->channels),
                image->channels, 255, out);
        }
    };
    auto* bytes = const_cast<std::uint8_t*>(view.bytes);
    for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
            const std::size_t from =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) +
                static_cast<std::size_t>(x);
            std::uint8_t b[4] = {255, 255, 255, 255}, n[4] = {128, 128, 255, 255},
                         s[4] = {255, 255, 255, 255};
            read(base, from, b);
            read(normal, from, n);
            read(surface, from, s);
            const std::size_t block =
                static_cast<std::size_t>((y >> 1) * view.blocks_per_row + (x >> 2));
            std::uint8_t* out =
                bytes + 8 * (block * 8 + static_cast<std::size_t>((y & 1) * 4 + (x & 3)));
            const std::uint8_t texel[8] = {b[0], b[1], b[2], n[2], n[0], n[1], s[1], s[2]};
            std::copy(texel, texel + 8, out);
        }
    }
}

}  // namespace

void TextureSet::FreeAligned::operator()(void* p) const { std::free(p); }

void* TextureSet::Allocate(std::size_t bytes) {
    storage_.emplace_back(AllocateAligned(bytes));
    bytes_ += bytes;
    return storage_.back().get();
}

TextureSet::TextureSet(Scene* scene, const std::vector<bool>& used,
                       const std::vector<TexturePack>& packs) {
    views_.resize(scene->textures.size());
    pictures_.resize(scene->images.size());
    std::vector<bool> packed(scene->textures.size(), false);
    for (const TexturePack& pack : packs) {
        for (const TextureId id : {pack.base, pack.normal, pack.metallic_roughness}) {
            if (id >= 0) {
                packed[static_cast<std::size_t>(id)] = true;
            }
        }
    }
    // Memory first, here; then the texels, in parallel.
    std::vector<bool> plain(scene->images.size(), false);
    for (std::size_t i = 0; i < scene->textures.size(); ++i) {
        if (!used[i]) {
            continue;
        }
        const std::size_t index = static_cast<std::size_t>(scene->textures[i].image);
        RequirePixels(scene->images[index]);
        if (!packed[i]) {
            if (!plain[index]) {
                AddPicture(*scene, index);
                plain[index] = true;
            }
            views_[i] = MakeView(*scene, i);
        }
    }
    for (const TexturePack& pack : packs) {
        AddPack(*scene, pack);
    }
    ParallelFor(0, packs.size() + pictures_.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (i < packs.size()) {
                FillPack(*scene, packs[i], packs_[i]);
                for (const TextureId id :
                     {packs[i].base, packs[i].normal, packs[i].metallic_roughness}) {
                    if (id >= 0) {
                        Free(&scene->images[static_cast<std::size_t>(
                            scene->textures[static_cast<std::size_t>(id)].image)]);
                    }
                }
            } else if (plain[i - packs.size()]) {
                SceneImage& image = scene->images[i - packs.size()];
                FillPicture(image, pictures_[i - packs.size()]);
                Free(&image);
            }
        }
    });
}

TextureView TextureSet::MakeView(const Scene& scene, std::size_t index) const {
    const Texture& texture = scene.textures[index];
    TextureView view = pictures_[static_cast<std::size_t>(texture.image)];
    SetAddressing(texture, &view);
    return view;
}

void TextureSet::AddPicture(const Scene& scene, std::size_t index) {
    const SceneImage& image = scene.images[index];
    TextureView& picture = pictures_[index];
    // A picture of one colour is one texel.
    const bool uniform = IsUniform(image);
    picture.width = uniform ? 1 : image.width;
    picture.height = uniform ? 1 : image.height;
    picture.blocks_per_row = (picture.width + 3) / 4;
    const std::size_t w = static_cast<std::size_t>(picture.width);
    const std::size_t h = static_cast<std::size_t>(picture.height);
    if (image.bytes.empty()) {
        picture.floats = static_cast<const Rgba*>(Allocate(w * h * sizeof(Rgba)));
    } else {
        picture.bytes =
            static_cast<const std::uint8_t*>(Allocate(((w + 3) / 4) * ((h + 3) / 4) * kLine));
    }
}

void TextureSet::AddPack(const Scene& scene, const TexturePack& pack) {
    const TextureId any = std::max({pack.base, pack.normal, pack.metallic_roughness});
    const Texture& texture = scene.textures[static_cast<std::size_t>(any)];
    const SceneImage& image = scene.images[static_cast<std::size_t>(texture.image)];
    TextureView view;
    view.width = image.width;
    view.height = image.height;
    view.blocks_per_row = (view.width + 3) / 4;
    view.bytes = static_cast<const std::uint8_t*>(
        Allocate(static_cast<std::size_t>(view.blocks_per_row) *
                 static_cast<std::size_t>((view.height + 1) / 2) * kLine));
    SetAddressing(texture, &view);
    packs_.push_back(view);
}

}  // namespace relume::render
