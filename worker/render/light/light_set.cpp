#include "worker/render/light/light_set.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace relume::render {
namespace {

constexpr double kLeastEnvironment = 0.25, kMostEnvironment = 0.5;

}  // namespace

LightSet::LightSet(const Scene& scene, const std::vector<CompiledMaterial>& materials,
                   const TextureSet& textures, std::shared_ptr<const EnvironmentLight> environment,
                   Accel* accel)
    : materials_(materials),
      textures_(textures),
      accel_(*accel),
      environment_(std::move(environment)) {
    const float radius = scene.Bounds().empty() ? 1.0f : scene.Bounds().radius();
    std::vector<LightExtent> extents;
    Powers powers;
    for (std::size_t o = 0; o < scene.instances.size(); ++o) {
        const Instance& instance = scene.instances[o];
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
        Object& object = accel->objects()[o];
        if (materials[object.material].IsEmissive() && object.motion != nullptr) {
            moving_emitters_ = true;
        } else if (materials[object.material].IsEmissive()) {
            object.first_light = static_cast<std::int32_t>(area_of_.size());
            AddAreaLights(mesh, instance.to_world, static_cast<std::uint32_t>(o), object, &extents,
                          &powers);
        }
    }
    emissive_surfaces_ = !areas_.empty();
    AddPunctualLights(scene, radius, &extents, &powers);
    tree_ = LightTree(extents);
    if (tree_.empty()) {  // surfaces that never shine
        areas_.clear();
        area_of_.clear();
        for (Object& object : accel->objects()) {
            object.first_light = -1;
        }
    }
    ShareOut(powers, radius);
}

void LightSet::AddPunctualLights(const Scene& scene, float radius,
                                 std::vector<LightExtent>* extents, Powers* powers) {
    for (const Light& light : scene.lights) {
        const PunctualLight compiled = CompileLight(scene, light);
        const double power = compiled.Power(radius);
        if (!(power > 0)) {
            continue;
        }
        if (compiled.kind == PunctualLight::Kind::kDirectional) {
            directional_.push_back({compiled});
            powers->directional.push_back(power);
        } else {
            punctual_.push_back(compiled);
            extents->push_back(compiled.Extent());
            powers->placed += power;
        }
    }
}

void LightSet::ShareOut(const Powers& powers, float radius) {
    const double others = std::accumulate(powers.directional.begin(), powers.directional.end(),
                                          tree_.empty() ? 0.0 : powers.placed);
    double left = 1;
    if (!environment_->black()) {
        const double power = environment_->mean() * 4 * kPi * kPi * radius * radius;
        const double share =
            others > 0 ? std::clamp(power / (power + others), kLeastEnvironment, kMostEnvironment)
                       : 1;
        environment_probability_ = static_cast<float>(share);
        left -= share;
    }
    if (!(others > 0)) {
        return;
    }
    placed_probability_ = tree_.empty() ? 0 : static_cast<float>(left * (powers.placed / others));
    for (std::size_t i = 0; i < directional_.size(); ++i) {
        directional_[i].probability = static_cast<float>(left * (powers.directional[i] / others));
    }
}

std::optional<LightSample> LightSet::Sample(const LightReceiver& at, std::uint32_t choice, Vec2f u,
                                            const EnvironmentLight::Place* drawn) const {
    LightSample sample;
    if (ChoosesEnvironment(choice)) {
        if (!environment_->SampleAt(drawn != nullptr ? *drawn : environment_->Draw(u), &sample)) {
            return std::nullopt;
        }
        sample.pdf *= environment_probability_;
        return sample;
    }
    double left = choice * 0x1p-32;
    if (placed_probability_ > 0) {
        if (directional_.empty() || left < placed_probability_) {
            return SamplePlaced(at, std::min(left / placed_probability_, 0x1.fffffffffffffp-1), u);
        }
        left -= placed_probability_;
    }
    for (std::size_t i = 0; i < directional_.size(); ++i) {
        const Directional& directional = directional_[i];
        if (left < directional.probability || i + 1 == directional_.size()) {
            sample.pdf = directional.probability;
            directional.light.Illuminate(at.point, &sample);
            return sample;
        }
        left -= directional.probability;
    }
    return std::nullopt;
}

std::optional<LightSample> LightSet::SamplePlaced(const LightReceiver& at, double u,
                                                  Vec2f uv) const {
    std::uint32_t light = 0;
    float probability = 0;
    if (!tree_.Sample(at, u, &light, &probability)) {
        return std::nullopt;
    }
    probability *= placed_probability_;
    if (light < areas_.size()) {
        auto sample = SampleArea(areas_[light], at.point, uv);
        if (sample) {
            sample->pdf *= probability;
        }
        return sample;
    }
    LightSample sample;
    sample.pdf = probability;
    if (!punctual_[light - areas_.size()].Illuminate(at.point, &sample)) {
        return std::nullopt;
    }
    return sample;
}

float LightSet::AreaPdf(const LightReceiver& from, const Object& object, std::uint32_t triangle,
                        float distance, Vec3f direction, Vec3f normal) const {
    const std::uint32_t i = area_of_[static_cast<std::uint32_t>(object.first_light) + triangle];
    const float probability = placed_probability_ * tree_.Probability(from, i);
    if (!(probability > 0)) {
        return 0;
    }
    if (const auto seen = areas_[i].SeenFrom(from.point)) {
        return probability / seen->solid_angle();
    }
    const float cosine = std::abs(Dot(normal, direction));
    return cosine > 0 ? probability * areas_[i].inverse_area * distance * distance / cosine : 0;
}

Rgb LightSet::Environment(const EnvironmentLight::Place& place, float* pdf) const {
    if (environment_probability_ == 0) {
        if (pdf != nullptr) {
            *pdf = 0;
        }
        return {};
    }
    const Rgb radiance = environment_->RadianceAt(place, pdf);
    if (pdf != nullptr) {
        *pdf *= environment_probability_;
    }
    return radiance;
}

}  // namespace relume::render
