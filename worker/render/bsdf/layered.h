#pragma once

#include "worker/render/bsdf/metallic_roughness.h"

namespace relume::render {

// Metallic-roughness under sheen (KHR_materials_sheen) and a clear coat (KHR_materials_clearcoat).
// Each layer takes its albedo from what lies below, on the way in and on the way out.
struct LayeredModel {
    // `coat_normal`: local, of the coat.
    LayeredModel(const LobeSite& site, Vec3f coat_normal, LobeTraits* traits);
    BsdfValue Evaluate(Vec3f wi) const;
    bool Sample(Vec2f u, float choice, LobeSample* sample) const;

  private:
    float SheenAlbedo(float cos_theta) const;
    // What the coat leaves to all below it, on both ways; `cos_coat`: of wi over its normal.
    float CoatLeft(float cos_coat) const;
    // What coat and sheen leave to the base at wi; `cos_coat`: over the coat's normal.
    float Left(Vec3f wi, float cos_coat) const;

    MetallicRoughnessModel base_;
    Vec3f wo_;
    float coat_ = 0, coat_alpha_ = 0;
    bool coat_delta_ = false;
    Vec3f coat_normal_;
    float coat_cosine_ = 1;  // of wo
    AlbedoRow coat_row_;
    Rgb sheen_;
    float sheen_most_ = 0, sheen_alpha_ = 1;
    float sheen_left_o_ = 1;
    float sheen_row_ = 0;
    float coat_left_o_ = 1;
    float coat_probability_ = 0, sheen_probability_ = 0, base_probability_ = 1;
};

// Charlie's distribution of sheen (Estevez and Kulla 2017, "Production Friendly Microfacet Sheen
// BRDF") with the visibility term of Neubelt and Pettineo: directional albedo for colour 1.
float SheenDirectionalAlbedo(float cos_theta, float roughness);

}  // namespace relume::render
