#pragma once

#include "worker/render/bsdf/albedo_table.h"
#include "worker/render/bsdf/dielectric.h"
#include "worker/render/bsdf/lobe.h"

namespace relume::render {

// glTF 2.0, appendix B: GGX reflection over a diffuse base, and glass. What the reflection takes,
// on the way in and on the way out, the base doesn't get (Kelemen and Szirmay-Kalos 2001), so that
// energy is conserved exactly; metals compensate for multiple scattering between microfacets (Kulla
// and Conty 2017).
struct MetallicRoughnessModel {
    MetallicRoughnessModel(const LobeSite& site, LobeTraits* traits);
    BsdfValue Evaluate(Vec3f wi) const;
    bool Sample(Vec2f u, float choice, LobeSample* sample) const;

    // Estimated share of light that is scattered at all, for choosing between lobes.
    float albedo_estimate = 0;

  private:
    BsdfValue EvaluateOpaque(Vec3f wi) const;

    Vec3f wo_;
    Rgb diffuse_;   // over pi, without the reflection's share at wi
    Rgb multiple_;  // multiple scattering in metals, over pi, without the factor at wi
    Rgb f0_;
    float f90_ = 1;
    float specular_ = 0;                            // weight of the GGX reflection
    float dielectric_f0_ = 0, dielectric_f90_ = 1;  // of the layer over the diffuse base
    float alpha_ = 1;
    AlbedoRow row_;
    float glass_weight_ = 0;
    Glass glass_;

    float diffuse_probability_ = 0, specular_probability_ = 0, glass_probability_ = 0;
    bool specular_delta_ = false;
};

}  // namespace relume::render
