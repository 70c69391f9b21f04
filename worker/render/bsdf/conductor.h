#pragma once

#include "worker/render/bsdf/dielectric.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/lobe.h"

namespace relume::render {

// Fresnel reflectance of a metal, by its complex index or as a colour straight on.
struct MetalFresnel {
    Rgb eta{1, 1, 1}, k;
    bool constant = false;  // k is the reflectance at every angle

    // `medium`: index of what lies over the metal.
    MetalFresnel() = default;
    MetalFresnel(const LobeSite& site, float medium);
    Rgb operator()(float cos_i) const {
        return constant
                   ? k
                   : Rgb{FresnelConductor(cos_i, eta.x, k.x), FresnelConductor(cos_i, eta.y, k.y),
                         FresnelConductor(cos_i, eta.z, k.z)};
    }
};

// GGX reflection by a metal, single scattering (as pbrt's).
struct ConductorModel {
    Vec3f wo;
    ggx::Alpha alpha;
    bool delta = false;
    MetalFresnel fresnel;

    ConductorModel(const LobeSite& site, LobeTraits* traits);
    BsdfValue Evaluate(Vec3f wi) const;
    bool Sample(Vec2f u, float, LobeSample* sample) const;
};

// eta, k or reflectance, fresnel.
void ReadConductor(const ParamSet& params, const Scene& scene, CompiledMaterial* material);

}  // namespace relume::render
