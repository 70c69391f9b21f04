// Material "conductor".
#include "worker/render/bsdf/conductor.h"

#include "core/base/error.h"
#include "worker/render/bsdf/params.h"

namespace relume::render {

void ReadConductor(const ParamSet& params, const Scene& scene, CompiledMaterial* m) {
    m->fresnel = params.GetBool("fresnel", true);
    m->has_reflectance = params.Has("reflectance") || params.Has("reflectance_texture");
    if (m->has_reflectance) {
        if (params.Has("eta") || params.Has("k")) {
            ThrowInvalidArgument("give either eta and k or reflectance, not both");
        }
        m->base_color = ReadColor(params, "reflectance", {1, 1, 1});
        m->base_color_texture = ReadTexture(params, "reflectance_texture", scene);
        return;
    }
    if (!m->fresnel) {
        ThrowInvalidArgument("fresnel false needs a reflectance");
    }
    m->eta = ReadColor(params, "eta", {0.2f, 0.92f, 1.1f});  // copper
    m->k = ReadColor(params, "k", {3.9f, 2.45f, 2.14f});
}

CompiledMaterial MakeConductor(const ParamSet& params, const Scene& scene) {
    CompiledMaterial m;
    m.model = Model::kConductor;
    ReadSurfaceParams(params, scene, &m);
    ReadConductor(params, scene, &m);
    ReadAlphas(params, 0, scene, &m);
    return m;
}

MetalFresnel::MetalFresnel(const LobeSite& site, float medium) {
    const CompiledMaterial& m = site.material;
    if (!m.has_reflectance) {
        eta = m.eta / medium;
        k = m.k / medium;
        return;
    }
    const Rgb r = Min(site.Color(m.base_color, m.base_color_texture), {1, 1, 1});
    constant = !m.fresnel;
    if (constant) {
        k = r;
        return;
    }
    const auto k_of = [](float v) {
        v = std::min(v, 0.9999f);
        return 2 * std::sqrt(v / (1 - v));
    };
    eta = Rgb{1, 1, 1} / medium;
    k = Rgb{k_of(r.x), k_of(r.y), k_of(r.z)} / medium;
}

ConductorModel::ConductorModel(const LobeSite& site, LobeTraits* traits)
    : wo(site.wo), fresnel(site, 1) {
    const CompiledMaterial& m = site.material;
    alpha = AlphaAt(site, m.alpha_u, m.alpha_u_texture, m.alpha_v, m.alpha_v_texture);
    delta = ggx::IsSmooth(alpha);
    traits->albedo = fresnel(1);
    traits->smooth = !delta;
    traits->near_specular = std::max(alpha.x, alpha.y) < kNearSpecularAlpha;
}

BsdfValue ConductorModel::Evaluate(Vec3f wi) const {
    if (delta || wi.z <= 0) {
        return {};
    }
    const Vec3f h = Normalize(wo + wi);
    const float d = ggx::D(h, alpha);
    return {fresnel(Dot(wo, h)) * (d * ggx::Visibility(wo, wi, alpha)),
            ggx::ReflectionPdf(d, wo, alpha)};
}

bool ConductorModel::Sample(Vec2f u, float, LobeSample* sample) const {
    if (delta) {
        sample->wi = {-wo.x, -wo.y, wo.z};
        sample->delta = true;
        sample->weight = fresnel(wo.z);
        return true;
    }
    const Vec3f h = ggx::SampleVisibleNormal(wo, alpha, u);
    const Vec3f wi = Reflect(wo, h);
    if (wi.z <= 0) {
        return false;
    }
    // f cos / pdf = F G2 / G1
    const float slope_o = ggx::Slope(wo, alpha), slope_i = ggx::Slope(wi, alpha);
    sample->wi = wi;
    sample->pdf = 0.5f * ggx::D(h, alpha) / (wo.z + slope_o);
    sample->weight =
        fresnel(Dot(wo, h)) * (wi.z * (wo.z + slope_o) / (wi.z * slope_o + wo.z * slope_i));
    return true;
}

}  // namespace relume::render
