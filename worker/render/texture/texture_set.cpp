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

}  // namespace

void TextureSet::FreeAligned::operator()(void* p) const { std::free(p); }

TextureSet::TextureSet(const Scene& scene, const std::vector<bool>& used) {
    views_.resize(scene.textures.size());
    storage_.resize(scene.images.size());
    std::vector<TextureView> pictures(scene.images.size());
    for (std::size_t i = 0; i < scene.textures.size(); ++i) {
        if (!used[i]) {
            continue;
        }
        const std::size_t index = static_cast<std::size_t>(scene.textures[i].image);
        const SceneImage& image = scene.images[index];
        TextureView& picture = pictures[index];
        const std::size_t values = static_cast<std::size_t>(image.width) *
                                   static_cast<std::size_t>(image.height) *
                                   static_cast<std::size_t>(image.channels);
        if (values == 0 || std::max(image.bytes.size(), image.floats.size()) < values) {
            ThrowInvalidArgument(fmt::format(
                "{}: the picture has no pixels; load the scene with its images", image.name));
        }
        if (storage_[index] == nullptr) {
            // A picture of one colour is one texel.
            const bool uniform = IsUniform(image);
            picture.width = uniform ? 1 : image.width;
            picture.height = uniform ? 1 : image.height;
            picture.blocks_per_row = (picture.width + 3) / 4;
            const std::size_t w = static_cast<std::size_t>(picture.width);
            const std::size_t h = static_cast<std::size_t>(picture.height);
            const bool is_float = image.bytes.empty();
            const std::size_t size =
                is_float ? w * h * sizeof(Rgba) : ((w + 3) / 4) * ((h + 3) / 4) * kLine;
            storage_[index].reset(AllocateAligned(size));
            bytes_ += size;
            if (is_float) {
                picture.floats = static_cast<const Rgba*>(storage_[index].get());
            } else {
                picture.bytes = static_cast<const std::uint8_t*>(storage_[index].get());
            }
        }
        const Texture& texture = scene.textures[i];
        TextureView& view = views_[i];
        view = picture;
        view.srgb = texture.srgb;
        view.nearest = texture.nearest;
        view.wrap_u = texture.wrap_u;
        view.wrap_v = texture.wrap_v;
        std::copy(texture.uv_transform, texture.uv_transform + 6, view.m);
        const float identity[6] = {1, 0, 0, 0, 1, 0};
        view.transformed = !std::equal(view.m, view.m + 6, identity);
    }
    ParallelFor(0, pictures.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (storage_[i] == nullptr) {
                continue;
            }
            const SceneImage& image = scene.images[i];
            const TextureView& picture = pictures[i];
            const std::size_t channels = static_cast<std::size_t>(image.channels);
            for (int y = 0; y < picture.height; ++y) {
                for (int x = 0; x < picture.width; ++x) {
                    const std::size_t from =
                        static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                        static_cast<std::size_t>(x);
                    if (picture.floats != nullptr) {
                        ExpandTexel(image.floats.data() + from * channels, image.channels, 1.0f,
                                    static_cast<float*>(storage_[i].get()) + from * 4);
                        continue;
                    }
                    const std::size_t block =
                        static_cast<std::size_t>((y >> 2) * picture.blocks_per_row + (x >> 2));
                    const std::size_t to =
                        block * 16 + static_cast<std::size_t>((y & 3) * 4 + (x & 3));
                    ExpandTexel<std::uint8_t>(
                        image.bytes.data() + from * channels, image.channels, 255,
                        static_cast<std::uint8_t*>(storage_[i].get()) + to * 4);
                }
            }
        }
    });
}

}  // namespace relume::render
