#pragma once

#include <cstdint>

namespace relume::render {

// Index of Scene::textures; negative: none.
using TextureId = std::int32_t;

// Linear values; alpha 1 where the picture has none, grey pictures repeated into R, G and B.
struct alignas(16) Rgba {
    float r, g, b, a;
};

}  // namespace relume::render
