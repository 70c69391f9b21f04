#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/math/vec.h"
#include "core/scene/scene.h"
#include "worker/render/texture/texel.h"
#include "worker/render/texture/texture_pack.h"

namespace relume::render {

// A texture as lookups read it. 8-bit pictures are RGBA, in blocks of 4 x 4 texels (one cache
// line), so that the four neighbours of a lookup are mostly on one line; pictures of floats are
// plain rows of Rgba. A pack has 8 bytes a texel, R G B of the base, Z X Y of the normal, roughness
// and metallic, in blocks of 4 x 2.
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
    // Converts the pictures behind the textures marked in `used` (one flag a texture), each once,
    // and takes 8-bit ones out of the scene when they are done. What stands in `packs` stands
    // nowhere else: those textures can be read by LookupPack alone.
    TextureSet(Scene* scene, const std::vector<bool>& used, const std::vector<TexturePack>& packs);
    TextureSet() = default;

    // Bilinear (or nearest, if the texture says so) lookup; `id` must not be negative.
    Rgba Lookup(TextureId id, Vec2f uv) const;
    // Asks the memory for what Lookup will read.
    void Prefetch(TextureId id, Vec2f uv) const;

    // The same of the pack of this number.
    SurfaceTexels LookupPack(int pack, Vec2f uv) const;
    void PrefetchPack(int pack, Vec2f uv) const;

    // How far apart in uv neighbouring texels lie.
    Vec2f TexelSize(TextureId id) const;

    std::size_t bytes() const { return bytes_; }

  private:
    TextureView MakeView(const Scene& scene, std::size_t texture) const;
    void AddPicture(const Scene& scene, std::size_t image);
    void AddPack(const Scene& scene, const TexturePack& pack);

    std::vector<TextureView> views_;     // by texture
    std::vector<TextureView> pictures_;  // by image
    std::vector<TextureView> packs_;
    struct FreeAligned {
        void operator()(void* p) const;
    };
    void* Allocate(std::size_t bytes);
    std::vector<std::unique_ptr<void, FreeAligned>> storage_;
    std::size_t bytes_ = 0;
};

}  // namespace relume::render
