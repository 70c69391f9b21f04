// Materials "coated_diffuse" and "coated_conductor".
#include "worker/render/bsdf/coated.h"

#include <map>
#include <mutex>

#include "worker/render/bsdf/params.h"

namespace relume::render {
namespace {

// One table an index, shared by all materials and scenes of the process.
std::shared_ptr<const CoatTable> TableOf(float ior) {
    static std::mutex mutex;
    static std::map<float, std::weak_ptr<const CoatTable>> tables;
    const std::lock_guard lock(mutex);
    std::weak_ptr<const CoatTable>& known = tables[ior];
    std::shared_ptr<const CoatTable> table = known.lock();
    if (table == nullptr) {
        table = std::make_shared<const CoatTable>(ior);
        known = table;
    }
    return table;
}

CompiledMaterial MakeCoated(Model model, const ParamSet& params, const Scene& scene) {
    CompiledMaterial m;
    m.model = model;
    ReadSurfaceParams(params, scene, &m);
    m.ior = ReadInRange(params, "ior", 1.5f, 1, 100);
    ReadAlphas(params, 0, scene, &m);
    m.coat = TableOf(m.ior);
    return m;
}

// The direction below the mean surface, seen from there (z > 0).
Vec3f RefractInside(Vec3f w, float ior) {
    const float x = w.x / ior, y = w.y / ior;
    return {x, y, std::sqrt(std::max(1e-8f, 1 - x * x - y * y))};
}

}  // namespace

CompiledMaterial MakeCoatedDiffuse(const ParamSet& params, const Scene& scene) {
    CompiledMaterial m = MakeCoated(Model::kCoatedDiffuse, params, scene);
    ReadBaseColor(params, scene, &m);
    return m;
}

CompiledMaterial MakeCoatedConductor(const ParamSet& params, const Scene& scene) {
    CompiledMaterial m = MakeCoated(Model::kCoatedConductor, params, scene);
    ReadConductor(params, scene, &m);
    m.conductor_alpha_u = ReadInRange(params, "conductor_alpha_u", 0, 0, 1);
    m.conductor_alpha_v = ReadInRange(params, "conductor_alpha_v", m.conductor_alpha_u, 0, 1);
    m.conductor_alpha_u_texture = ReadTexture(params, "conductor_alpha_u_texture", scene);
    m.conductor_alpha_v_texture = ReadTexture(params, "conductor_alpha_v_texture", scene);
    return m;
}

Interface::Interface(const LobeSite& site) : wo(site.wo), ior(site.material.ior) {
    const CompiledMaterial& m = site.material;
    alpha = AlphaAt(site, m.alpha_u, m.alpha_u_texture, m.alpha_v, m.alpha_v_texture);
    delta = ggx::IsSmooth(alpha);
    albedo = m.coat->At(alpha.x == alpha.y ? alpha.x : std::sqrt(alpha.x * alpha.y));
    through = 1 - albedo.At(wo.z);
    internal = 1 - (1 - albedo.Mean()) / (ior * ior);
}

BsdfValue Interface::Evaluate(Vec3f wi) const {
    if (delta) {
        return {};
    }
    const Vec3f h = Normalize(wo + wi);
    const float d = ggx::D(h, alpha);
    const float f = FresnelDielectric(Dot(wo, h), ior) * d * ggx::Visibility(wo, wi, alpha);
    return {{f, f, f}, ggx::ReflectionPdf(d, wo, alpha)};
}

bool Interface::Sample(Vec2f u, LobeSample* sample) const {
    sample->delta = delta;
    if (delta) {
        const float f = 1 - through;
        sample->wi = {-wo.x, -wo.y, wo.z};
        sample->weight = {f, f, f};
        return true;
    }
    sample->wi = Reflect(wo, ggx::SampleVisibleNormal(wo, alpha, u));
    return sample->wi.z > 0;
}

CoatedDiffuseModel::CoatedDiffuseModel(const LobeSite& site, LobeTraits* traits) : interface(site) {
    const CompiledMaterial& m = site.material;
    const Rgb color = Min(site.Color(m.base_color, m.base_color_texture), {1, 1, 1});
    traits->albedo = color;
    const float i = interface.internal;
    const auto repeated = [&](float c) { return c / (1 - c * i); };
    const Rgb sum{repeated(color.x), repeated(color.y), repeated(color.z)};
    base = sum * (interface.through * kInvPi / (interface.ior * interface.ior));
    const float base_albedo = interface.through * (1 - i) * Average(sum);
    const float total = base_albedo + 1 - interface.through;
    interface_probability = total > 0 ? (1 - interface.through) / total : 1;
    traits->smooth = base_albedo > 0 || !interface.delta;
    traits->near_specular =
        std::max(interface.alpha.x, interface.alpha.y) < kNearSpecularAlpha && base_albedo < 0.05f;
}

BsdfValue CoatedDiffuseModel::Evaluate(Vec3f wi) const {
    if (wi.z <= 0) {
        return {};
    }
    BsdfValue value = interface.Evaluate(wi);
    value.f += base * (1 - interface.albedo.At(wi.z));
    value.pdf = value.pdf * interface_probability + (1 - interface_probability) * wi.z * kInvPi;
    return value;
}

bool CoatedDiffuseModel::Sample(Vec2f u, float, LobeSample* sample) const {
    if (!Choose(interface_probability, &u.x)) {
        sample->wi = SampleCosineHemisphere(u);
        return true;
    }
    const bool valid = interface.Sample(u, sample);
    sample->weight *= 1 / interface_probability;
    return valid;
}

CoatedConductorModel::CoatedConductorModel(const LobeSite& site, LobeTraits* traits)
    : interface(site), fresnel(site, interface.ior) {
    const CompiledMaterial& m = site.material;
    alpha = AlphaAt(site, m.conductor_alpha_u, m.conductor_alpha_u_texture, m.conductor_alpha_v,
                    m.conductor_alpha_v_texture);
    delta = ggx::IsSmooth(alpha);
    wo_inside = RefractInside(interface.wo, interface.ior);
    // A smooth metal under a rough interface has the interface's spread, narrowed by refraction.
    if (delta && !interface.delta) {
        alpha = {std::max(interface.alpha.x / interface.ior, ggx::kSmallestAlpha),
                 std::max(interface.alpha.y / interface.ior, ggx::kSmallestAlpha)};
        delta = false;
    }
    traits->albedo = fresnel(1);
    traits->smooth = !delta || !interface.delta;
    traits->near_specular = std::max(alpha.x, alpha.y) < kNearSpecularAlpha;
    const float metal = interface.through * interface.through * Average(fresnel(wo_inside.z));
    const float total = metal + 1 - interface.through;
    interface_probability = total > 0 ? (1 - interface.through) / total : 1;
}

Rgb CoatedConductorModel::Repeated(Rgb metal, float through_o, float through_i) const {
    const float back = 1 - 0.5f * (through_o + through_i);
    const auto sum = [&](float r) { return r / (1 - r * back); };
    return Rgb{sum(metal.x), sum(metal.y), sum(metal.z)} * (through_o * through_i);
}

BsdfValue CoatedConductorModel::Evaluate(Vec3f wi) const {
    if (wi.z <= 0) {
        return {};
    }
    BsdfValue value = interface.Evaluate(wi);
    value.pdf *= interface_probability;
    if (!delta) {
        const Vec3f inside = RefractInside(wi, interface.ior);
        const Vec3f h = Normalize(wo_inside + inside);
        const float d = ggx::D(h, alpha);
        // dw_inside cos_inside = dw cos / ior^2
        const float scale = 1 / (interface.ior * interface.ior);
        value.f +=
            Repeated(fresnel(Dot(wo_inside, h)), interface.through, 1 - interface.albedo.At(wi.z)) *
            (d * ggx::Visibility(wo_inside, inside, alpha) * scale);
        value.pdf += (1 - interface_probability) * ggx::ReflectionPdf(d, wo_inside, alpha) * scale *
                     wi.z / inside.z;
    }
    return value;
}

bool CoatedConductorModel::Sample(Vec2f u, float, LobeSample* sample) const {
    if (Choose(interface_probability, &u.x)) {
        const bool valid = interface.Sample(u, sample);
        sample->weight *= 1 / interface_probability;
        return valid;
    }
    if (delta) {
        sample->delta = true;
        sample->wi = {-interface.wo.x, -interface.wo.y, interface.wo.z};
        sample->weight = Repeated(fresnel(wo_inside.z), interface.through, interface.through) *
                         (1 / (1 - interface_probability));
        return true;
    }
    const Vec3f inside = Reflect(wo_inside, ggx::SampleVisibleNormal(wo_inside, alpha, u));
    const float x = inside.x * interface.ior, y = inside.y * interface.ior;
    const float z2 = 1 - x * x - y * y;
    if (inside.z <= 0 || z2 <= 0) {  // totally reflected: lost
        return false;
    }
    sample->wi = {x, y, std::sqrt(z2)};
    return true;
}

}  // namespace relume::render
