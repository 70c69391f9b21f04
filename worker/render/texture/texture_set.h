#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/math/vec.h"
#include "core/scene/scene.h"

namespace relume::render {

// Index of Scene::textures; negative: none.
using TextureId = std::int32_t;

// Linear values; alpha 1 where the picture has none, grey pictures repeated into R, G and B.
struct alignas(16) Rgba {
    float r, g, b, a;
};

// A texture as lookups read it. 8-bit pictures are RGBA, in blocks of 4 x 4 texels (one cache
// line), so that the four neighbours of a lookup are mostly on one line; pictures of floats are
// plain rows of Rgba.
struct TextureView {
    const std::uint8_t* bytes = nullptr;
    const Rgba* floats = nullptr;
    int width = 1, height = 1;
    int blocks_per_row = 1;
    bool srgb = false, nearest = false, transformed = false;
    WrapMode wrap_u = WrapMode::kRepeat, wrap_v = WrapMode::kRepeat;
    float m[6] = {1, 0, 0, 0, 1, 0};
};

// All textures of a scene that some material uses. Immutable, thread-safe.
class TextureSet {
  public:
    // Converts the pictures behind the textures marked in `used` (one flag a texture), each once.
    TextureSet(const Scene& scene, const std::vector<bool>& used);
    TextureSet() = default;

    // Bilinear (or nearest, if the texture says so) lookup; `id` must not be negative.
    Rgba Lookup(TextureId id, Vec2f uv) const;
    // Asks the memory for what Lookup will read.
    void Prefetch(TextureId id, Vec2f uv) const;

    // How far apart in uv neighbouring texels lie.
    Vec2f TexelSize(TextureId id) const;

    std::size_t bytes() const { return bytes_; }

  private:
    std::vector<TextureView> views_;
    struct FreeAligned {
        void operator()(void* p) const;
    };
    std::vector<std::unique_ptr<void, FreeAligned>> storage_;
    std::size_t bytes_ = 0;
};

}  // namespace relume::render
