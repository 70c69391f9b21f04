#include "worker/render/bsdf/bsdf.h"

#include <cmath>

#include "worker/render/sampler/hash.h"

namespace relume::render {
namespace {

// Calls f with what `model` holds. A switch of this form is compiled to one jump, or inlined.
template <class Variant, class F>
auto Visit(const Variant& model, F&& f) {
    switch (model.index()) {
        case 1:
            return f(*std::get_if<1>(&model));
        case 2:
            return f(*std::get_if<2>(&model));
        case 3:
            return f(*std::get_if<3>(&model));
        case 4:
            return f(*std::get_if<4>(&model));
        case 5:
            return f(*std::get_if<5>(&model));
        case 6:
            return f(*std::get_if<6>(&model));
        case 7:
            return f(*std::get_if<7>(&model));
        case 8:
            return f(*std::get_if<8>(&model));
        default:
            static_assert(std::variant_size_v<Variant> == 10);
            return f(*std::get_if<9>(&model));
    }
}

}  // namespace

Bsdf::Bsdf(const CompiledMaterial& m, const TextureSet& textures, Vec2f uv, const ShadingFrame& at,
           Vec3f wo, const SurfaceTexels* texels)
    : at_(at) {
    LobeSite site{m, textures, uv, at.frame.ToLocal(wo), at.front, texels};
    site.wo.z = std::max(site.wo.z, 1e-4f);
    switch (m.model) {
        case Model::kMetallicRoughness:
            model_.emplace<MetallicRoughnessModel>(site, &traits_);
            break;
        case Model::kLayered:
            model_.emplace<LayeredModel>(
                site, at.coat == Vec3f{} ? Vec3f{0, 0, 1} : at.frame.ToLocal(at.coat), &traits_);
            break;
        case Model::kConductor:
            model_.emplace<ConductorModel>(site, &traits_);
            break;
        case Model::kCoatedDiffuse:
            model_.emplace<CoatedDiffuseModel>(site, &traits_);
            break;
        case Model::kCoatedConductor:
            model_.emplace<CoatedConductorModel>(site, &traits_);
            break;
        case Model::kDielectric:
            model_.emplace<DielectricModel>(site, &traits_);
            break;
        case Model::kThinDielectric:
            model_.emplace<ThinDielectricModel>(site, &traits_);
            break;
        case Model::kDiffuseTransmission:
            model_.emplace<DiffuseTransmissionModel>(site, &traits_);
            break;
        case Model::kDiffuse:
        case Model::kMix:
            model_.emplace<DiffuseModel>(site, &traits_);
            break;
    }
}

BsdfValue Bsdf::Evaluate(Vec3f world) const {
    const Vec3f wi = at_.frame.ToLocal(world);
    if (!(wi.z * Dot(world, at_.geometric) > 0)) {
        return {};
    }
    return Visit(model_, [&](const auto& model) { return model.Evaluate(wi); });
}

std::optional<BsdfSample> Bsdf::Sample(Vec2f u, float choice) const {
    return Visit(model_, [&](const auto& model) -> std::optional<BsdfSample> {
        LobeSample local;
        if (!model.Sample(u, choice, &local)) {
            return std::nullopt;
        }
        BsdfSample sample;
        sample.wi = at_.frame.ToWorld(local.wi);
        if (!(local.wi.z * Dot(sample.wi, at_.geometric) > 0)) {
            return std::nullopt;
        }
        sample.eta2 = local.eta2;
        sample.transmitted = local.wi.z < 0;
        if (local.delta || local.pdf > 0) {
            sample.weight = local.weight;
            sample.pdf = local.pdf;
            return sample;
        }
        const BsdfValue value = model.Evaluate(local.wi);
        if (!(value.pdf > 0)) {
            return std::nullopt;
        }
        sample.weight = value.f * (std::abs(local.wi.z) / value.pdf);
        sample.pdf = value.pdf;
        return sample;
    });
}

const CompiledMaterial& ResolveMix(const CompiledMaterial& material,
                                   const std::vector<CompiledMaterial>& materials,
                                   const TextureSet& textures, Vec2f uv, std::uint32_t choice) {
    const CompiledMaterial* m = &material;
    while (m->model == Model::kMix) {
        const float amount = Textured(m->amount, m->amount_texture, textures, uv);
        choice = Hash(choice, 0x9e3779b9u);
        m = &materials[static_cast<std::size_t>(ToUnit(choice) < amount ? m->mix_b : m->mix_a)];
    }
    return *m;
}

}  // namespace relume::render
