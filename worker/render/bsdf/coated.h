#pragma once

#include "worker/render/bsdf/conductor.h"
#include "worker/render/bsdf/lobe.h"

namespace relume::render {

// A dielectric interface over a base: what reflects at it, smooth or rough.
struct Interface {
    Vec3f wo;
    ggx::Alpha alpha{0, 0};
    bool delta = false;
    float ior = 1.5f;
    CoatTable::Row albedo;
    float through = 0;   // 1 - albedo at wo
    float internal = 0;  // mean reflectance of diffuse light from within

    explicit Interface(const LobeSite& site);
    BsdfValue Evaluate(Vec3f wi) const;  // wi.z > 0
    bool Sample(Vec2f u, LobeSample* sample) const;
};

// Diffuse under an interface, with all light that goes to and fro between the two: what passes the
// interface is 1 minus its albedo on both ways; of diffuse light from within it reflects
// 1 - (1 - mean albedo) / ior^2, since the interface is reciprocal. A white base sends all back.
struct CoatedDiffuseModel {
    Interface interface;
    Rgb base;  // over pi, times `through`, without what the interface lets pass at wi
    float interface_probability = 0;

    CoatedDiffuseModel(const LobeSite& site, LobeTraits* traits);
    BsdfValue Evaluate(Vec3f wi) const;
    bool Sample(Vec2f u, float, LobeSample* sample) const;
};

// A metal under an interface. Light is refracted at the mean surface on its way in and out; what
// the interface sends back to the metal is summed as if it kept its angle.
struct CoatedConductorModel {
    Interface interface;
    Vec3f wo_inside;  // refracted wo, seen from the metal
    ggx::Alpha alpha{0, 0};
    bool delta = false;
    MetalFresnel fresnel;
    float interface_probability = 0;

    CoatedConductorModel(const LobeSite& site, LobeTraits* traits);
    BsdfValue Evaluate(Vec3f wi) const;
    bool Sample(Vec2f u, float, LobeSample* sample) const;

  private:
    // Of all passes between metal and interface, for one reflectance.
    Rgb Repeated(Rgb metal, float through_o, float through_i) const;
};

}  // namespace relume::render
