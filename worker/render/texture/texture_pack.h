#pragma once

#include "core/math/vec.h"
#include "worker/render/texture/texel.h"

namespace relume::render {

// Up to three 8-bit textures of one material that are always read at the same place: interleaved,
// so that a lookup finds them all on one or two cache lines. All have one size, transform and wrap;
// the base colour is sRGB, the others are linear. -1: none.
struct TexturePack {
    TextureId base = -1, normal = -1, metallic_roughness = -1;

    friend bool operator==(const TexturePack&, const TexturePack&) = default;
};

// What a pack gives at one place, all in [0, 1]; what it lacks reads as white, and as a flat
// normal.
struct SurfaceTexels {
    Rgb base;
    Vec3f normal;
    float roughness = 1, metallic = 1;
};

}  // namespace relume::render
