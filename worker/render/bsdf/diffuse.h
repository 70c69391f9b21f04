#pragma once

#include "worker/render/bsdf/lobe.h"
#include "worker/render/sampler/warp.h"

namespace relume::render {

// Lambert's law, or that of Oren and Nayar 1994 (the qualitative model, equation 30).
struct DiffuseModel {
    Rgb color;  // albedo over pi
    float a = 1, b = 0;
    Vec3f wo;

    DiffuseModel(const LobeSite& site, LobeTraits* traits);
    BsdfValue Evaluate(Vec3f wi) const;
    bool Sample(Vec2f u, float, LobeSample* sample) const {
        sample->wi = SampleCosineHemisphere(u);
        if (b == 0) {
            sample->weight = color * kPi;
            sample->pdf = sample->wi.z * kInvPi;
        }
        return true;
    }
};

// Lambertian on both sides.
struct DiffuseTransmissionModel {
    Rgb reflected, transmitted;  // albedos over pi
    float reflect_probability = 1;

    DiffuseTransmissionModel(const LobeSite& site, LobeTraits* traits);
    BsdfValue Evaluate(Vec3f wi) const;
    bool Sample(Vec2f u, float choice, LobeSample* sample) const;
};

}  // namespace relume::render
