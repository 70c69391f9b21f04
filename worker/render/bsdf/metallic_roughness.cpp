// Material "metallic_roughness": glTF 2.0, appendix B, with KHR_materials_transmission, _ior,
// _specular and _volume; those with a clear coat or sheen are layered.cpp's.
#include "worker/render/bsdf/metallic_roughness.h"

#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/params.h"

namespace relume::render {

void ReadLayers(const ParamSet& params, const Scene& scene, CompiledMaterial* material);

CompiledMaterial MakeMetallicRoughness(const ParamSet& params, const Scene& scene) {
    CompiledMaterial m;
    m.model = Model::kMetallicRoughness;
    ReadSurfaceParams(params, scene, &m);
    ReadBaseColor(params, scene, &m);
    m.metallic = ReadInRange(params, "metallic", 1, 0, 1);
    m.roughness = ReadInRange(params, "roughness", 1, 0, 1);
    m.metallic_roughness_texture = ReadTexture(params, "metallic_roughness_texture", scene);
    m.ior = ReadInRange(params, "ior", 1.5f, 0.1f, 100);
    m.transmission = ReadInRange(params, "transmission", 0, 0, 1);
    m.transmission_texture = ReadTexture(params, "transmission_texture", scene);
    m.thin = params.GetBool("thin", true);
    ReadAbsorption(params, &m);
    m.has_glass = m.transmission > 0;
    m.absorbs = m.absorbs && m.has_glass && !m.thin;
    if (m.metallic == 0 && m.metallic_roughness_texture >= 0 && m.roughness == 0) {
        m.metallic_roughness_texture = -1;  // scaled by zero
    }
    m.specular = ReadInRange(params, "specular", 1, 0, 1);
    m.specular_texture = ReadTexture(params, "specular_texture", scene);
    m.specular_color = ReadColor(params, "specular_color", {1, 1, 1});
    m.specular_color_texture = ReadTexture(params, "specular_color_texture", scene);
    ReadLayers(params, scene, &m);
    return m;
}

MetallicRoughnessModel::MetallicRoughnessModel(const LobeSite& site, LobeTraits* traits)
    : wo_(site.wo) {
    const CompiledMaterial& m = site.material;
    const Rgb base = site.texels != nullptr ? m.base_color * site.texels->base
                                            : site.Color(m.base_color, m.base_color_texture);
    traits->albedo = base;
    float roughness = m.roughness, metallic = m.metallic;
    if (site.texels != nullptr) {
        roughness *= site.texels->roughness;
        metallic *= site.texels->metallic;
    } else if (m.metallic_roughness_texture >= 0) {
        const Rgba t = site.textures.Lookup(m.metallic_roughness_texture, site.uv);
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
        glass_weight_ = (1 - metallic) * site.Number(m.transmission, m.transmission_texture);
        glass_.Set(wo_, {alpha_, alpha_}, m.ior, m.thin, site.front);
        glass_.transmit = base;
    }

    // The opaque part.
    float diffuse_albedo = 0, specular_albedo = 0;
    const float opaque = 1 - glass_weight_;
    if (opaque > 0) {
        metallic = std::min(metallic / opaque, 1.0f);
        const float straight = F0FromIor(m.ior);
        Rgb f0{straight, straight, straight};
        if (m.specular != 1 || m.specular_texture >= 0 || m.specular_color_texture >= 0 ||
            !(m.specular_color == Rgb{1, 1, 1})) {
            dielectric_f90_ = m.specular;
            if (m.specular_texture >= 0) {
                dielectric_f90_ *= site.textures.Lookup(m.specular_texture, site.uv).a;
            }
            f0 = Min(f0 * site.Color(m.specular_color, m.specular_color_texture), {1, 1, 1}) *
                 dielectric_f90_;
        }
        dielectric_f0_ = MaxComponent(f0);
        f0_ = Lerp(metallic, f0, base);
        f90_ = dielectric_f90_ + metallic * (1 - dielectric_f90_);
        specular_ = opaque;
        specular_delta_ = mirror;
        row_ = AlbedoRow(roughness);
        const Albedo here = row_.At(wo_.z), mean = row_.Mean();
        specular_albedo = opaque * here(Average(f0_), f90_);
        if (metallic < 1) {
            const float left = 1 - here(dielectric_f0_, dielectric_f90_);
            diffuse_ = base * (opaque * (1 - metallic) * kInvPi * left /
                               (1 - mean(dielectric_f0_, dielectric_f90_)));
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
    const float total = diffuse_albedo + specular_albedo + glass_weight_;
    albedo_estimate = total;
    if (total > 0) {
        diffuse_probability_ = diffuse_albedo / total;
        specular_probability_ = specular_albedo / total;
        glass_probability_ = glass_weight_ / total;
    }
    traits->smooth = diffuse_probability_ > 0 || (specular_probability_ > 0 && !specular_delta_) ||
                     (glass_probability_ > 0 && !glass_.delta);
    traits->near_specular = alpha_ < kNearSpecularAlpha && diffuse_albedo < 0.05f;
    traits->needs_choice = glass_probability_ > 0;
}

BsdfValue MetallicRoughnessModel::EvaluateOpaque(Vec3f wi) const {
    if (wi.z <= 0) {
        return {};
    }
    const Albedo there = row_.At(wi.z);
    BsdfValue value{diffuse_ * (1 - there(dielectric_f0_, dielectric_f90_)) +
                        multiple_ * std::max(0.0f, 1 - there.Full()),
                    diffuse_probability_ * wi.z * kInvPi};
    if (!specular_delta_) {
        const Vec3f h = Normalize(wo_ + wi);
        const float d = ggx::D(h, alpha_);
        value.f += FresnelSchlick(f0_, f90_, Dot(wo_, h)) *
                   (specular_ * d * ggx::Visibility(wo_, wi, alpha_));
        value.pdf += specular_probability_ * ggx::ReflectionPdf(d, wo_, alpha_);
    }
    return value;
}

BsdfValue MetallicRoughnessModel::Evaluate(Vec3f wi) const {
    BsdfValue value = specular_ > 0 ? EvaluateOpaque(wi) : BsdfValue{};
    if (glass_probability_ > 0) {
        const BsdfValue glass = glass_.Evaluate(wi);
        value.f += glass.f * glass_weight_;
        value.pdf += glass.pdf * glass_probability_;
    }
    return value;
}

bool MetallicRoughnessModel::Sample(Vec2f u, float choice, LobeSample* sample) const {
    if (u.x < diffuse_probability_) {
        u.x = std::min(u.x / diffuse_probability_, kBelowOne);
        sample->wi = SampleCosineHemisphere(u);
        return true;
    }
    u.x -= diffuse_probability_;
    if (u.x < specular_probability_ || glass_probability_ == 0) {
        if (specular_delta_) {
            sample->wi = {-wo_.x, -wo_.y, wo_.z};
            sample->delta = true;
            sample->weight = FresnelSchlick(f0_, f90_, wo_.z) * (specular_ / specular_probability_);
            return specular_probability_ > 0;
        }
        u.x = std::min(u.x / specular_probability_, kBelowOne);
        sample->wi = Reflect(wo_, ggx::SampleVisibleNormal(wo_, alpha_, u));
        return sample->wi.z > 0;
    }
    u.x = std::min((u.x - specular_probability_) / glass_probability_, kBelowOne);
    const bool valid = glass_.Sample(u, choice, sample);
    sample->weight *= glass_weight_ / glass_probability_;
    return valid;
}

}  // namespace relume::render
