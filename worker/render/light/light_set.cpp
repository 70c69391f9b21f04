#include "worker/render/light/light_set.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "worker/render/sampler/sobol.h"
#include "worker/render/sampler/warp.h"

namespace relume::render {
namespace {

constexpr double kLeastEnvironment = 0.25, kMostEnvironment = 0.5;
// Points at which the emission of a textured triangle is averaged.
constexpr std::uint32_t kEmissionPoints = 64;

float MeanEmission(const CompiledMaterial& material, const TextureSet& textures,
                   const TriangleData* data) {
    const bool uniform = material.emissive_texture < 0 &&
                         !(material.SeesThrough() && material.base_color_texture >= 0);
    if (uniform || data == nullptr) {
        return Average(Emission(material, textures, {})) *
               (material.SeesThrough() ? Opacity(material, textures, {}) : 1);
    }
    float sum = 0;
    for (std::uint32_t i = 0; i < kEmissionPoints; ++i) {
        const Barycentric b = SampleTriangle({(static_cast<float>(i) + 0.5f) / kEmissionPoints,
                                              static_cast<float>(ReverseBits(i)) * 0x1p-32f});
        const Vec2f uv = data->Uv(b.b1, b.b2);
        sum += Average(Emission(material, textures, uv)) *
               (material.SeesThrough() ? Opacity(material, textures, uv) : 1);
    }
    return sum / kEmissionPoints;
}

}  // namespace

LightSet::LightSet(const Scene& scene, const std::vector<CompiledMaterial>& materials,
                   const TextureSet& textures, Accel* accel)
    : materials_(materials), textures_(textures), accel_(*accel) {
    std::vector<double> powers;
    AddAreaLights(scene, accel, &powers);
    emissive_surfaces_ = !areas_.empty();
    const float radius = scene.Bounds().empty() ? 1.0f : scene.Bounds().radius();
    for (const Light& light : scene.lights) {
        const PunctualLight compiled = CompileLight(light);
        const double power = compiled.Power(radius);
        if (power > 0) {
            punctual_.push_back(compiled);
            powers.push_back(power);
        }
    }
    if (scene.environment != nullptr) {
        environment_ = EnvironmentLight(scene, *scene.environment);
    }
    if (!environment_.black()) {
        const double others = std::accumulate(powers.begin(), powers.end(), 0.0);
        const double power = environment_.mean() * 4 * kPi * kPi * radius * radius;
        const double share =
            others > 0 ? std::clamp(power / (power + others), kLeastEnvironment, kMostEnvironment)
                       : 1;
        for (double& p : powers) {
            p *= others > 0 ? (1 - share) / others : 0;
        }
        powers.push_back(share);
        if (others == 0) {  // what never shines is not in the table
            areas_.clear();
            for (Object& object : accel->objects()) {
                object.first_light = -1;
            }
            powers.assign(1, 1);
        }
    }
    table_ = AliasTable(powers);
    for (std::size_t i = 0; i < areas_.size(); ++i) {
        areas_[i].pdf *= black() ? 0 : table_.Probability(i);  // was 1 / area
    }
    if (black()) {
        return;
    }
    if (!environment_.black()) {
        environment_probability_ = table_.Probability(table_.size() - 1);
    }
}

void LightSet::AddAreaLights(const Scene& scene, Accel* accel, std::vector<double>* powers) {
    for (std::size_t o = 0; o < scene.instances.size(); ++o) {
        const Instance& instance = scene.instances[o];
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
        const CompiledMaterial& material = materials_[static_cast<std::size_t>(mesh.material)];
        if (!material.IsEmissive()) {
            continue;
        }
        Object& object = accel->objects()[o];
        object.first_light = static_cast<std::int32_t>(areas_.size());
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            const Vec3u v = mesh.triangles[i];
            AreaLight light;
            light.p0 = instance.to_world.Point(mesh.positions[v.x]);
            light.e1 = instance.to_world.Point(mesh.positions[v.y]) - light.p0;
            light.e2 = instance.to_world.Point(mesh.positions[v.z]) - light.p0;
            light.size = LargestEdge(mesh, v) * object.scale;
            light.object = static_cast<std::uint32_t>(o);
            light.triangle = static_cast<std::uint32_t>(i);
            const Vec3f normal = Cross(light.e1, light.e2) * (object.mirrored ? -1.0f : 1.0f);
            const float length = Length(normal);
            double power = 0;
            if (length > 0) {
                light.normal = normal / length;
                light.pdf = 2 / length;
                const TriangleData* data =
                    object.triangles == nullptr ? nullptr : object.triangles + i;
                power = 0.5 * length * kPi * MeanEmission(material, textures_, data) *
                        (material.double_sided ? 2 : 1);
            }
            areas_.push_back(light);
            powers->push_back(std::isfinite(power) ? power : 0);
        }
    }
}

std::optional<LightSample> LightSet::SampleArea(const AreaLight& light, Vec3f p, Vec2f u) const {
    const Barycentric b = SampleTriangle(u);
    const Vec3f to_light = light.p0 + light.e1 * b.b1 + light.e2 * b.b2 - p;
    const float distance2 = Length2(to_light);
    if (!(distance2 > 0)) {
        return std::nullopt;
    }
    LightSample sample;
    sample.distance = std::sqrt(distance2);
    sample.wi = to_light * (1 / sample.distance);
    float cosine = -Dot(light.normal, sample.wi);
    const Object& object = accel_.objects()[light.object];
    const CompiledMaterial& material = materials_[object.material];
    if (material.double_sided) {
        cosine = std::abs(cosine);
    }
    if (cosine <= 0) {
        return std::nullopt;
    }
    Vec2f uv;
    if (object.triangles != nullptr) {
        uv = object.triangles[light.triangle].Uv(b.b1, b.b2);
    }
    sample.radiance = Emission(material, textures_, uv);
    if (material.SeesThrough()) {  // a ray that comes by chance is stopped as often
        sample.radiance *= Opacity(material, textures_, uv);
    }
    sample.pdf = light.pdf * distance2 / cosine;
    const Vec3f q = p + to_light;
    const float coordinate = std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z), light.size});
    sample.clearance = std::min(coordinate * 0x1p-19f / cosine, 0.5f * sample.distance);
    return sample;
}

std::optional<LightSample> LightSet::Sample(Vec3f p, std::uint32_t choice, Vec2f u) const {
    const std::size_t i = single() ? 0 : table_.Sample(choice);
    if (i < areas_.size()) {
        return SampleArea(areas_[i], p, u);
    }
    LightSample sample;
    if (i - areas_.size() < punctual_.size()) {
        sample.pdf = table_.Probability(i);
        if (!punctual_[i - areas_.size()].Illuminate(p, &sample)) {
            return std::nullopt;
        }
        return sample;
    }
    if (!environment_.Sample(u, &sample)) {
        return std::nullopt;
    }
    sample.pdf *= environment_probability_;
    return sample;
}

float LightSet::AreaPdf(const Object& object, std::uint32_t triangle, float distance,
                        Vec3f direction, Vec3f normal) const {
    const AreaLight& light = areas_[static_cast<std::size_t>(object.first_light) + triangle];
    const float cosine = std::abs(Dot(normal, direction));
    return cosine > 0 ? light.pdf * distance * distance / cosine : 0;
}

Rgb LightSet::Environment(Vec3f direction, float* pdf) const {
    if (environment_probability_ == 0) {
        if (pdf != nullptr) {
            *pdf = 0;
        }
        return {};
    }
    const Rgb radiance = environment_.Radiance(direction, pdf);
    if (pdf != nullptr) {
        *pdf *= environment_probability_;
    }
    return radiance;
}

}  // namespace relume::render
