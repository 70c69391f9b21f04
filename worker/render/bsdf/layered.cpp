// The layers of "metallic_roughness": KHR_materials_clearcoat and KHR_materials_sheen.
#include "worker/render/bsdf/layered.h"

#include <array>

#include "core/math/frame.h"

#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/params.h"
#include "worker/render/sampler/elementary.h"

namespace relume::render {
namespace {

constexpr float kCoatF0 = 0.04f;  // of the coat's index, 1.5
// Thinner fibres than this are noise to floats (glTF allows 0).
constexpr float kLeastSheenRoughness = 0.07f;
constexpr int kSheenSize = 32;

float SheenDistribution(float cos_h, float alpha) {
    const float sin2 = std::max(1 - cos_h * cos_h, 0.0f);
    return (2 + 1 / alpha) * Pow(sin2, 0.5f / alpha) * (0.5f * kInvPi);
}

float SheenVisibility(float o, float i) { return 1 / (4 * (o + i - o * i)); }

using SheenTable = std::array<std::array<float, kSheenSize>, kSheenSize>;  // [roughness][cosine]

const SheenTable& GetSheenTable() {
    static const SheenTable table = [] {
        SheenTable t{};
        constexpr int kTheta = 48, kPhi = 48;
        for (std::size_t r = 0; r < kSheenSize; ++r) {
            const float roughness =
                std::max(static_cast<float>(r) / (kSheenSize - 1), kLeastSheenRoughness);
            for (std::size_t c = 0; c < kSheenSize; ++c) {
                const float cosine = std::max(static_cast<float>(c) / (kSheenSize - 1), 1e-3f);
                const Vec3f wo{std::sqrt(1 - cosine * cosine), 0, cosine};
                double sum = 0;
                for (int i = 0; i < kTheta; ++i) {
                    // Uniform in the cosine.
                    const float z = (static_cast<float>(i) + 0.5f) / kTheta;
                    const float s = std::sqrt(1 - z * z);
                    for (int j = 0; j < kPhi; ++j) {
                        const SinCos phi = SinCosTurn((static_cast<float>(j) + 0.5f) / kPhi);
                        const Vec3f wi{s * phi.cos, s * phi.sin, z};
                        const Vec3f h = Normalize(wo + wi);
                        sum += static_cast<double>(SheenDistribution(h.z, roughness * roughness) *
                                                   SheenVisibility(cosine, z) * z);
                    }
                }
                t[r][c] = std::min(static_cast<float>(sum * 2 * M_PI / (kTheta * kPhi)), 1.0f);
            }
        }
        return t;
    }();
    return table;
}

}  // namespace

float SheenDirectionalAlbedo(float cos_theta, float roughness) {
    const SheenTable& table = GetSheenTable();
    const float y = std::clamp(roughness, 0.0f, 1.0f) * (kSheenSize - 1);
    const float x = std::clamp(cos_theta, 0.0f, 1.0f) * (kSheenSize - 1);
    const int r = std::min(static_cast<int>(y), kSheenSize - 2);
    const int c = std::min(static_cast<int>(x), kSheenSize - 2);
    const float ty = y - static_cast<float>(r), tx = x - static_cast<float>(c);
    const auto& low = table[static_cast<std::size_t>(r)];
    const auto& high = table[static_cast<std::size_t>(r) + 1];
    const std::size_t i = static_cast<std::size_t>(c);
    const float a = low[i] + tx * (low[i + 1] - low[i]);
    const float b = high[i] + tx * (high[i + 1] - high[i]);
    return a + ty * (b - a);
}

// Reads the layers' parameters; a material that has any is of the layered model.
void ReadLayers(const ParamSet& params, const Scene& scene, CompiledMaterial* m) {
    m->clearcoat = ReadInRange(params, "clearcoat", 0, 0, 1);
    m->clearcoat_texture = ReadTexture(params, "clearcoat_texture", scene);
    m->clearcoat_roughness = ReadInRange(params, "clearcoat_roughness", 0, 0, 1);
    m->clearcoat_roughness_texture = ReadTexture(params, "clearcoat_roughness_texture", scene);
    m->clearcoat_normal_texture = ReadTexture(params, "clearcoat_normal_texture", scene);
    m->clearcoat_normal_scale = params.GetFloat("clearcoat_normal_scale", 1);
    m->sheen_color = ReadColor(params, "sheen_color", {0, 0, 0});
    m->sheen_color_texture = ReadTexture(params, "sheen_color_texture", scene);
    m->sheen_roughness = ReadInRange(params, "sheen_roughness", 0, 0, 1);
    m->sheen_roughness_texture = ReadTexture(params, "sheen_roughness_texture", scene);
    if (!(m->clearcoat > 0)) {  // an absent layer's pictures are not read
        m->clearcoat_texture = m->clearcoat_roughness_texture = m->clearcoat_normal_texture = -1;
    }
    if (!(MaxComponent(m->sheen_color) > 0)) {
        m->sheen_color_texture = m->sheen_roughness_texture = -1;
    }
    if (m->clearcoat > 0 || MaxComponent(m->sheen_color) > 0) {
        m->model = Model::kLayered;
    }
}

LayeredModel::LayeredModel(const LobeSite& site, Vec3f coat_normal, LobeTraits* traits)
    : base_(site, traits), wo_(site.wo), coat_normal_(coat_normal) {
    const CompiledMaterial& m = site.material;
    float sheen_albedo = 0;
    sheen_ = site.Color(m.sheen_color, m.sheen_color_texture);
    sheen_most_ = std::min(MaxComponent(sheen_), 1.0f);
    if (sheen_most_ > 0) {
        sheen_row_ = m.sheen_roughness;
        if (m.sheen_roughness_texture >= 0) {
            sheen_row_ *= site.textures.Lookup(m.sheen_roughness_texture, site.uv).a;
        }
        sheen_row_ = std::max(sheen_row_, kLeastSheenRoughness);
        sheen_alpha_ = sheen_row_ * sheen_row_;
        sheen_albedo = SheenAlbedo(wo_.z);
        sheen_left_o_ = 1 - sheen_most_ * sheen_albedo;
    }
    float coat_albedo = 0;
    coat_ = site.Number(m.clearcoat, m.clearcoat_texture);
    coat_cosine_ = Dot(wo_, coat_normal_);
    if (coat_ > 0 && coat_cosine_ > 0) {
        float roughness = m.clearcoat_roughness;
        if (m.clearcoat_roughness_texture >= 0) {
            roughness *= site.textures.Lookup(m.clearcoat_roughness_texture, site.uv).g;
        }
        coat_alpha_ = roughness * roughness;
        coat_delta_ = coat_alpha_ < ggx::kSmallestAlpha;
        coat_row_ = AlbedoRow(coat_delta_ ? 0 : roughness);
        coat_albedo = coat_ * coat_row_.At(coat_cosine_)(kCoatF0, 1);
        coat_left_o_ = 1 - coat_albedo;
    } else {
        coat_ = 0;
    }
    const float sheen = coat_left_o_ * Average(sheen_) * sheen_albedo;
    const float base = coat_left_o_ * sheen_left_o_ * base_.albedo_estimate;
    const float total = coat_albedo + sheen + base;
    if (total > 0) {
        coat_probability_ = coat_albedo / total;
        sheen_probability_ = sheen / total;
        base_probability_ = base / total;
    }
    traits->smooth = traits->smooth || sheen_most_ > 0 || (coat_ > 0 && !coat_delta_);
    traits->near_specular = traits->near_specular && sheen_most_ == 0;
}

float LayeredModel::SheenAlbedo(float cos_theta) const {
    return SheenDirectionalAlbedo(cos_theta, sheen_row_);
}

float LayeredModel::CoatLeft(float cos_coat) const {
    return coat_ > 0 ? coat_left_o_ * (1 - coat_ * coat_row_.At(std::abs(cos_coat))(kCoatF0, 1))
                     : coat_left_o_;
}

float LayeredModel::Left(Vec3f wi, float cos_coat) const {
    float left = CoatLeft(cos_coat);
    if (sheen_most_ > 0) {
        left *= std::min(sheen_left_o_, 1 - sheen_most_ * SheenAlbedo(std::abs(wi.z)));
    }
    return left;
}

BsdfValue LayeredModel::Evaluate(Vec3f wi) const {
    BsdfValue value = base_.Evaluate(wi);
    const float cos_coat = Dot(wi, coat_normal_);
    value.f *= Left(wi, cos_coat);
    value.pdf *= base_probability_;
    if (wi.z <= 0) {
        return value;
    }
    if (sheen_most_ > 0) {
        const Vec3f h = Normalize(wo_ + wi);
        value.f += sheen_ * (SheenDistribution(h.z, sheen_alpha_) * SheenVisibility(wo_.z, wi.z) *
                             CoatLeft(cos_coat));
        value.pdf += sheen_probability_ * wi.z * kInvPi;
    }
    if (coat_ > 0 && !coat_delta_ && cos_coat > 0) {
        const Frame frame = Frame::FromZ(coat_normal_);
        const Vec3f o = frame.ToLocal(wo_), i = frame.ToLocal(wi);
        const Vec3f h = Normalize(o + i);
        const float d = ggx::D(h, coat_alpha_);
        // f is over the base's cosine: the coat's own is put in its place.
        const float f = coat_ * FresnelSchlick({kCoatF0, 0, 0}, 1, Dot(o, h)).x * d *
                        ggx::Visibility(o, i, coat_alpha_) * cos_coat / wi.z;
        value.f += {f, f, f};
        value.pdf += coat_probability_ * ggx::ReflectionPdf(d, o, coat_alpha_);
    }
    return value;
}

bool LayeredModel::Sample(Vec2f u, float choice, LobeSample* sample) const {
    if (coat_probability_ > 0 && Choose(coat_probability_, &u.x)) {
        if (coat_delta_) {
            sample->delta = true;
            sample->wi = Reflect(wo_, coat_normal_);
            const float f =
                coat_ * FresnelSchlick({kCoatF0, 0, 0}, 1, coat_cosine_).x / coat_probability_;
            sample->weight = {f, f, f};
            return sample->wi.z > 0;
        }
        const Frame frame = Frame::FromZ(coat_normal_);
        const Vec3f o = frame.ToLocal(wo_);
        sample->wi = frame.ToWorld(Reflect(o, ggx::SampleVisibleNormal(o, coat_alpha_, u)));
        return sample->wi.z > 0;
    }
    const float rest = 1 - coat_probability_;
    if (sheen_probability_ > 0 && Choose(sheen_probability_ / rest, &u.x)) {
        sample->wi = SampleCosineHemisphere(u);
        return true;
    }
    if (!(base_probability_ > 0) || !base_.Sample(u, choice, sample)) {
        return false;
    }
    if (sample->delta) {
        sample->weight *= Left(sample->wi, Dot(sample->wi, coat_normal_)) / base_probability_;
    }
    return true;
}

}  // namespace relume::render
