#include "worker/render/bsdf/bsdf.h"

#include <cmath>

#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ggx.h"
#include "worker/render/sampler/warp.h"

namespace relume::render {
namespace {

// Index ratios this close to 1 don't bend light: rough transmission would divide by zero.
constexpr float kSameIndex = 1e-3f;

}  // namespace

Bsdf::Bsdf(const CompiledMaterial& m, const TextureSet& textures, Vec2f uv, const ShadingFrame& at,
           Vec3f wo)
    : at_(at), wo_(at.frame.ToLocal(wo)) {
    wo_.z = std::max(wo_.z, 1e-4f);

    // Parameters at this point.
    Rgb base = m.base_color;
    if (m.base_color_texture >= 0) {
        const Rgba t = textures.Lookup(m.base_color_texture, uv);
        base *= Rgb{t.r, t.g, t.b};
    }
    albedo_ = base;
    if (!m.has_specular && !m.has_glass) {  // Lambert
        diffuse_ = base * kInvPi;
        smooth_ = MaxComponent(base) > 0;
        diffuse_probability_ = smooth_ ? 1.0f : 0.0f;
        return;
    }
    float roughness = m.roughness, metallic = m.has_specular ? m.metallic : 0;
    if (m.metallic_roughness_texture >= 0) {
        const Rgba t = textures.Lookup(m.metallic_roughness_texture, uv);
        roughness *= t.g;
        metallic *= t.b;
    }
    alpha_ = roughness * roughness;
    const bool mirror = alpha_ < ggx::kSmallestAlpha;
    if (mirror) {
        alpha_ = 0;
        roughness = 0;
    }
    if (m.has_glass) {
        float transmission = m.transmission;
        if (m.transmission_texture >= 0) {
            transmission *= textures.Lookup(m.transmission_texture, uv).r;
        }
        glass_ = (1 - metallic) * transmission;
        thin_ = m.thin;
        eta_ = thin_ || at.front ? m.ior : 1 / m.ior;
        tint_ = base;
        glass_delta_ = mirror || (!thin_ && std::abs(eta_ - 1) < kSameIndex);
    }

    // The opaque part: reflection over a diffuse base. What the reflection takes, on the way in and
    // on the way out, the base doesn't get (Kelemen and Szirmay-Kalos 2001), so that energy is
    // conserved exactly.
    float diffuse_albedo = 0, specular_albedo = 0;
    const float opaque = m.has_opaque ? 1 - glass_ : 0;
    if (opaque > 0) {
        metallic = std::min(metallic / opaque, 1.0f);
        dielectric_f0_ = F0FromIor(m.ior);
        f0_ = Lerp(metallic, Rgb{dielectric_f0_, dielectric_f0_, dielectric_f0_}, base);
        specular_ = opaque;
        specular_delta_ = mirror;
        coupled_ = true;
        row_ = AlbedoRow(roughness);
        const Albedo here = row_.At(wo_.z), mean = row_.Mean();
        specular_albedo = opaque * here(Average(f0_));
        if (metallic < 1) {
            const float left = 1 - here(dielectric_f0_);
            diffuse_ =
                base * (opaque * (1 - metallic) * kInvPi * left / (1 - mean(dielectric_f0_)));
            diffuse_albedo = Average(base) * opaque * (1 - metallic) * left;
        }
        const float lost = 1 - mean.Full();
        if (metallic > 0 && !mirror && lost > 1e-3f) {
            // Kulla and Conty 2017; colour of repeated reflection by Fdez-Aguera 2019, equation 12.
            const Rgb f = base + (Rgb{1, 1, 1} - base) * (1.0f / 21);
            const auto repeated = [&](float c) { return c * c * mean.Full() / (1 - c * lost); };
            const Rgb color{repeated(f.x), repeated(f.y), repeated(f.z)};
            const float left = std::max(0.0f, 1 - here.Full());
            multiple_ = color * (opaque * metallic * kInvPi * left / lost);
            diffuse_albedo += Average(color) * opaque * metallic * left;
        }
    }

    // Lobes are chosen by their albedo.
    const float total = diffuse_albedo + specular_albedo + glass_;
    if (total > 0) {
        diffuse_probability_ = diffuse_albedo / total;
        specular_probability_ = specular_albedo / total;
        glass_probability_ = glass_ / total;
    }
    smooth_ = diffuse_probability_ > 0 || (specular_probability_ > 0 && !specular_delta_) ||
              (glass_probability_ > 0 && !glass_delta_);
    near_specular_ = alpha_ < 0.01f && diffuse_albedo < 0.05f;
}

BsdfValue Bsdf::EvaluateOpaque(Vec3f wi) const {
    if (wi.z <= 0) {
        return {};
    }
    BsdfValue value{diffuse_, diffuse_probability_ * wi.z * kInvPi};
    if (!coupled_) {
        return value;
    }
    const Albedo there = row_.At(wi.z);
    value.f = diffuse_ * (1 - there(dielectric_f0_)) + multiple_ * std::max(0.0f, 1 - there.Full());
    if (!specular_delta_) {
        const Vec3f h = Normalize(wo_ + wi);
        const float d = ggx::D(h, alpha_);
        value.f += FresnelSchlick(f0_, Dot(wo_, h)) *
                   (specular_ * d * ggx::Visibility(wo_.z, wi.z, alpha_));
        value.pdf += specular_probability_ * ggx::ReflectionPdf(d, wo_.z, alpha_);
    }
    return value;
}

// Rough glass, thin or solid: Walter et al. 2007, sections 4 and 5.
BsdfValue Bsdf::EvaluateGlass(Vec3f wi) const {
    const bool reflects = wi.z > 0;
    if (reflects || thin_) {
        // A thin sheet sends out the mirror image of its reflection lobe.
        const Vec3f w = reflects ? wi : Vec3f{wi.x, wi.y, -wi.z};
        if (w.z <= 0) {
            return {};
        }
        const Vec3f h = Normalize(wo_ + w);
        const float d = ggx::D(h, alpha_);
        const float fresnel = FresnelDielectric(Dot(wo_, h), eta_);
        const float share = reflects ? fresnel : 1 - fresnel;
        const float f = glass_ * share * d * ggx::Visibility(wo_.z, w.z, alpha_);
        return {reflects ? Rgb{f, f, f} : tint_ * f,
                glass_probability_ * share * ggx::ReflectionPdf(d, wo_.z, alpha_)};
    }
    Vec3f h = Normalize(wi * eta_ + wo_);
    h = h.z < 0 ? -h : h;
    const float ho = Dot(wo_, h), hi = Dot(wi, h);
    if (wi.z == 0 || ho <= 0 || hi >= 0) {
        return {};
    }
    const float fresnel = FresnelDielectric(ho, eta_);
    const float d = ggx::D(h, alpha_);
    const float root = hi + ho / eta_;
    const float jacobian = -hi / (root * root);
    // Smith's G2 over cos_o cos_i is four times the visibility term of the reflection.
    const float f = glass_ * (1 - fresnel) * d * 4 * ggx::Visibility(wo_.z, -wi.z, alpha_) * ho *
                    jacobian / (eta_ * eta_);
    const float visible = 4 * ho * ggx::ReflectionPdf(d, wo_.z, alpha_);
    return {tint_ * f, glass_probability_ * (1 - fresnel) * visible * jacobian};
}

BsdfValue Bsdf::EvaluateLocal(Vec3f wi) const {
    BsdfValue value = EvaluateOpaque(wi);
    if (glass_probability_ > 0 && !glass_delta_) {
        const BsdfValue glass = EvaluateGlass(wi);
        value.f += glass.f;
        value.pdf += glass.pdf;
    }
    return value;
}

BsdfValue Bsdf::Evaluate(Vec3f world) const {
    const Vec3f wi = at_.frame.ToLocal(world);
    return wi.z * Dot(world, at_.geometric) > 0 ? EvaluateLocal(wi) : BsdfValue{};
}

Bsdf::Lobe Bsdf::ChooseLobe(float* u) const {
    constexpr float kBelowOne = 0x1.fffffep-1f;
    if (*u < diffuse_probability_) {
        *u = std::min(*u / diffuse_probability_, kBelowOne);
        return Lobe::kDiffuse;
    }
    *u -= diffuse_probability_;
    if (*u < specular_probability_ || glass_probability_ == 0) {
        *u = std::min(*u / specular_probability_, kBelowOne);
        return Lobe::kSpecular;
    }
    *u = std::min((*u - specular_probability_) / glass_probability_, kBelowOne);
    return Lobe::kGlass;
}

bool Bsdf::SampleSpecular(Vec2f u, Vec3f* wi, BsdfSample* sample) const {
    if (specular_delta_) {
        *wi = {-wo_.x, -wo_.y, wo_.z};
        sample->weight = FresnelSchlick(f0_, wo_.z) * (specular_ / specular_probability_);
        return true;
    }
    *wi = Reflect(wo_, ggx::SampleVisibleNormal(wo_, alpha_, u));
    return wi->z > 0;
}

bool Bsdf::SampleGlass(Vec2f u, float choice, Vec3f* wi, BsdfSample* sample) const {
    const Vec3f m = glass_delta_ ? Vec3f{0, 0, 1} : ggx::SampleVisibleNormal(wo_, alpha_, u);
    const float weight = glass_ / glass_probability_;
    if (choice < FresnelDielectric(Dot(wo_, m), eta_)) {
        *wi = Reflect(wo_, m);
        sample->weight = {weight, weight, weight};
        return wi->z > 0;
    }
    sample->weight = tint_ * weight;
    if (thin_) {
        *wi = Reflect(wo_, m);
        wi->z = -wi->z;
        return wi->z < 0;
    }
    if (std::abs(eta_ - 1) < kSameIndex) {
        *wi = -wo_;
        return true;
    }
    if (!Refract(wo_, m, eta_, wi) || wi->z >= 0) {
        return false;
    }
    sample->eta2 = eta_ * eta_;
    sample->weight *= 1 / sample->eta2;
    return true;
}

std::optional<BsdfSample> Bsdf::Sample(Vec2f u, float choice) const {
    if (diffuse_probability_ + specular_probability_ + glass_probability_ <= 0) {
        return std::nullopt;
    }
    Vec3f local;
    BsdfSample sample;
    bool delta = false, valid = true;
    switch (ChooseLobe(&u.x)) {
        case Lobe::kDiffuse:
            local = SampleCosineHemisphere(u);
            break;
        case Lobe::kSpecular:
            delta = specular_delta_;
            valid = SampleSpecular(u, &local, &sample);
            break;
        case Lobe::kGlass:
            delta = glass_delta_;
            valid = SampleGlass(u, choice, &local, &sample);
            break;
    }
    if (!valid) {
        return std::nullopt;
    }
    sample.wi = Normalize(at_.frame.ToWorld(local));
    if (local.z * Dot(sample.wi, at_.geometric) <= 0) {
        return std::nullopt;
    }
    if (delta) {
        return sample;
    }
    const BsdfValue value = EvaluateLocal(local);
    if (!(value.pdf > 0)) {
        return std::nullopt;
    }
    sample.weight = value.f * (std::abs(local.z) / value.pdf);
    sample.pdf = value.pdf;
    return sample;
}

}  // namespace relume::render
