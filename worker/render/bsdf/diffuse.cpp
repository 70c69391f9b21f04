// Materials "diffuse" and "diffuse_transmission".
#include "worker/render/bsdf/diffuse.h"

#include "worker/render/bsdf/params.h"

namespace relume::render {

CompiledMaterial MakeDiffuse(const ParamSet& params, const Scene& scene) {
    CompiledMaterial m;
    ReadSurfaceParams(params, scene, &m);
    ReadBaseColor(params, scene, &m);
    const float sigma = ReadInRange(params, "sigma", 0, 0, 90) * (kPi / 180);
    const float s2 = sigma * sigma;
    m.oren_nayar_a = 1 - s2 / (2 * (s2 + 0.33f));
    m.oren_nayar_b = 0.45f * s2 / (s2 + 0.09f);
    return m;
}

CompiledMaterial MakeDiffuseTransmission(const ParamSet& params, const Scene& scene) {
    CompiledMaterial m;
    m.model = Model::kDiffuseTransmission;
    ReadSurfaceParams(params, scene, &m);
    ReadBaseColor(params, scene, &m);
    m.transmit = ReadColor(params, "transmittance", {0, 0, 0});
    m.transmit_texture = ReadTexture(params, "transmittance_texture", scene);
    return m;
}

DiffuseModel::DiffuseModel(const LobeSite& site, LobeTraits* traits)
    : a(site.material.oren_nayar_a), b(site.material.oren_nayar_b), wo(site.wo) {
    traits->albedo = site.Color(site.material.base_color, site.material.base_color_texture);
    traits->smooth = MaxComponent(traits->albedo) > 0;
    color = traits->albedo * kInvPi;
}

BsdfValue DiffuseModel::Evaluate(Vec3f wi) const {
    if (wi.z <= 0) {
        return {};
    }
    BsdfValue value{color, wi.z * kInvPi};
    if (b > 0) {
        // sin sin cos(difference of azimuths) is the product of the horizontal parts; sin tan of
        // the larger and the smaller angle is that over the larger cosine.
        const float across = std::max(0.0f, wo.x * wi.x + wo.y * wi.y);
        value.f *= a + b * across / std::max(wo.z, wi.z);
    }
    return value;
}

DiffuseTransmissionModel::DiffuseTransmissionModel(const LobeSite& site, LobeTraits* traits) {
    const CompiledMaterial& m = site.material;
    reflected = site.Color(m.base_color, m.base_color_texture);
    transmitted = site.Color(m.transmit, m.transmit_texture);
    const Rgb sum = reflected + transmitted;
    const float most = MaxComponent(sum);
    if (most > 1) {  // no more leaves than arrives
        reflected *= 1 / most;
        transmitted *= 1 / most;
    }
    traits->albedo = Min(sum, {1, 1, 1});
    traits->smooth = most > 0;
    traits->needs_choice = true;
    reflect_probability = most > 0 ? Average(reflected) / Average(reflected + transmitted) : 1;
    reflected *= kInvPi;
    transmitted *= kInvPi;
}

BsdfValue DiffuseTransmissionModel::Evaluate(Vec3f wi) const {
    return wi.z > 0 ? BsdfValue{reflected, reflect_probability * wi.z * kInvPi}
                    : BsdfValue{transmitted, (1 - reflect_probability) * -wi.z * kInvPi};
}

bool DiffuseTransmissionModel::Sample(Vec2f u, float choice, LobeSample* sample) const {
    sample->wi = SampleCosineHemisphere(u);
    if (choice >= reflect_probability) {
        sample->wi.z = -sample->wi.z;
    }
    return true;
}

}  // namespace relume::render
