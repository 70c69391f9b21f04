// Materials "dielectric" and "thin_dielectric".
#include "worker/render/bsdf/dielectric.h"

#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/params.h"

namespace relume::render {
namespace {

// Index ratios this close to 1 don't bend light: rough transmission would divide by zero.
constexpr float kSameIndex = 1e-3f;

}  // namespace

CompiledMaterial MakeDielectric(const ParamSet& params, const Scene& scene) {
    CompiledMaterial m;
    m.model = Model::kDielectric;
    ReadSurfaceParams(params, scene, &m);
    m.thin = false;
    m.ior = ReadInRange(params, "ior", 1.5f, 0.1f, 100);
    const float roughness = ReadInRange(params, "roughness", 0, 0, 1);
    ReadAlphas(params, roughness * roughness, scene, &m);
    m.reflect = ReadColor(params, "reflect", {1, 1, 1});
    m.reflect_texture = ReadTexture(params, "reflect_texture", scene);
    m.transmit = ReadColor(params, "tint", {1, 1, 1});
    m.transmit_texture = ReadTexture(params, "tint_texture", scene);
    ReadAbsorption(params, &m);
    return m;
}

CompiledMaterial MakeThinDielectric(const ParamSet& params, const Scene& scene) {
    CompiledMaterial m;
    m.model = Model::kThinDielectric;
    ReadSurfaceParams(params, scene, &m);
    m.ior = ReadInRange(params, "ior", 1.5f, 0.1f, 100);
    return m;
}

void Glass::Set(Vec3f w, ggx::Alpha a, float ior, bool is_thin, bool front) {
    wo = w;
    alpha = a;
    thin = is_thin;
    eta = thin || front ? ior : 1 / ior;
    delta = ggx::IsSmooth(a) || (!thin && std::abs(eta - 1) < kSameIndex);
}

BsdfValue Glass::Evaluate(Vec3f wi) const {
    if (delta) {
        return {};
    }
    const bool reflects = wi.z > 0;
    if (reflects || thin) {
        const Vec3f w = reflects ? wi : Vec3f{wi.x, wi.y, -wi.z};
        if (w.z <= 0) {
            return {};
        }
        const Vec3f h = Normalize(wo + w);
        const float d = ggx::D(h, alpha);
        const float fresnel = FresnelDielectric(Dot(wo, h), eta);
        const float share = reflects ? fresnel : 1 - fresnel;
        const float f = share * d * ggx::Visibility(wo, w, alpha);
        return {(reflects ? reflect : transmit) * f, share * ggx::ReflectionPdf(d, wo, alpha)};
    }
    Vec3f h = Normalize(wi * eta + wo);
    h = h.z < 0 ? -h : h;
    const float ho = Dot(wo, h), hi = Dot(wi, h);
    if (wi.z == 0 || ho <= 0 || hi >= 0) {
        return {};
    }
    const float fresnel = FresnelDielectric(ho, eta);
    const float d = ggx::D(h, alpha);
    const float root = hi + ho / eta;
    const float jacobian = -hi / (root * root);
    // Smith's G2 over cos_o cos_i is four times the visibility term of the reflection.
    const float f =
        (1 - fresnel) * d * 4 * ggx::Visibility(wo, wi, alpha) * ho * jacobian / (eta * eta);
    const float visible = 4 * ho * ggx::ReflectionPdf(d, wo, alpha);
    return {transmit * f, (1 - fresnel) * visible * jacobian};
}

bool Glass::Sample(Vec2f u, float choice, LobeSample* sample) const {
    sample->delta = delta;
    const Vec3f m = delta ? Vec3f{0, 0, 1} : ggx::SampleVisibleNormal(wo, alpha, u);
    Vec3f* wi = &sample->wi;
    if (choice < FresnelDielectric(Dot(wo, m), eta)) {
        *wi = Reflect(wo, m);
        sample->weight = reflect;
        return wi->z > 0;
    }
    sample->weight = transmit;
    if (thin) {
        *wi = Reflect(wo, m);
        wi->z = -wi->z;
        return wi->z < 0;
    }
    if (std::abs(eta - 1) < kSameIndex) {
        *wi = -wo;
        return true;
    }
    if (!Refract(wo, m, eta, wi) || wi->z >= 0) {
        return false;
    }
    sample->eta2 = eta * eta;
    sample->weight *= 1 / sample->eta2;
    return true;
}

DielectricModel::DielectricModel(const LobeSite& site, LobeTraits* traits) {
    const CompiledMaterial& m = site.material;
    Set(site.wo, AlphaAt(site, m.alpha_u, m.alpha_u_texture, m.alpha_v, m.alpha_v_texture), m.ior,
        false, site.front);
    reflect = site.Color(m.reflect, m.reflect_texture);
    transmit = site.Color(m.transmit, m.transmit_texture);
    traits->albedo = transmit;
    traits->smooth = !delta;
    traits->near_specular = std::max(alpha.x, alpha.y) < kNearSpecularAlpha;
    traits->needs_choice = true;
}

ThinDielectricModel::ThinDielectricModel(const LobeSite& site, LobeTraits* traits) : wo(site.wo) {
    const float once = FresnelDielectric(wo.z, site.material.ior);
    reflectance = 2 * once / (1 + once);  // the series of all reflections inside
    traits->albedo = {1, 1, 1};
    traits->near_specular = true;
    traits->needs_choice = true;
}

bool ThinDielectricModel::Sample(Vec2f, float choice, LobeSample* sample) const {
    sample->delta = true;
    sample->weight = {1, 1, 1};
    sample->wi = choice < reflectance ? Vec3f{-wo.x, -wo.y, wo.z} : -wo;
    return true;
}

}  // namespace relume::render
