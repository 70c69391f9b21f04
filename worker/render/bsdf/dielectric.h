#pragma once

#include "worker/render/bsdf/ggx.h"
#include "worker/render/bsdf/lobe.h"

namespace relume::render {

// The surface of glass, smooth or rough (Walter et al. 2007, sections 4 and 5, single scattering):
// of a solid, or (thin) of a sheet that sends out the mirror image of its reflection. Radiance is
// transported: refraction scales it by the square of the relative index.
struct Glass {
    Vec3f wo;
    ggx::Alpha alpha{0, 0};
    float eta = 1;  // index on the far side over that on the side of wo
    bool thin = false, delta = false;
    Rgb reflect{1, 1, 1}, transmit{1, 1, 1};

    // `ior`: inside over outside.
    void Set(Vec3f wo, ggx::Alpha alpha, float ior, bool thin, bool front);
    BsdfValue Evaluate(Vec3f wi) const;
    bool Sample(Vec2f u, float choice, LobeSample* sample) const;
};

struct DielectricModel : Glass {
    DielectricModel(const LobeSite& site, LobeTraits* traits);
};

// A pane without thickness, all reflections between its sides included: straight on or mirrored.
struct ThinDielectricModel {
    Vec3f wo;
    float reflectance = 0;

    ThinDielectricModel(const LobeSite& site, LobeTraits* traits);
    BsdfValue Evaluate(Vec3f) const { return {}; }
    bool Sample(Vec2f u, float choice, LobeSample* sample) const;
};

// GGX alphas from two numbers with textures, at least 0 and at most 1.
inline ggx::Alpha AlphaAt(const LobeSite& site, float u, TextureId u_texture, float v,
                          TextureId v_texture) {
    const ggx::Alpha a{std::min(site.Number(u, u_texture), 1.0f),
                       std::min(site.Number(v, v_texture), 1.0f)};
    if (ggx::IsSmooth(a)) {
        return {0, 0};
    }
    return {std::max(a.x, ggx::kSmallestAlpha), std::max(a.y, ggx::kSmallestAlpha)};
}

}  // namespace relume::render
