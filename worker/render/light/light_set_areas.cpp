// Lights that are surfaces: how they are gathered and drawn from.
#include <algorithm>
#include <array>
#include <cmath>

#include "worker/render/light/light_set.h"
#include "worker/render/sampler/sobol.h"
#include "worker/render/sampler/warp.h"

namespace relume::render {
namespace {

// Strengths are compared only: sums of these, over squared distances, stay finite.
constexpr float kMostStrength = 1e20f;
// Points at which the emission of a textured triangle is averaged.
constexpr std::uint32_t kEmissionPoints = 64;

float MeanEmission(const CompiledMaterial& material, const TextureSet& textures,
                   const TriangleData* data) {
    const bool uniform = material.emissive_texture < 0 &&
                         !(material.SeesThrough() &&
                           (material.base_color_texture >= 0 || material.alpha_texture >= 0));
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

Vec3f Abs(Vec3f v) { return {std::abs(v.x), std::abs(v.y), std::abs(v.z)}; }

// If the triangles p and q share an edge and make a parallelogram, turns p so that its first corner
// is the one opposite of q.
bool MakeParallelogram(std::array<Vec3f, 3>* p, const std::array<Vec3f, 3>& q) {
    constexpr float kTolerance = 1e-6f;  // of coordinates
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3f a = (*p)[i], b = (*p)[(i + 1) % 3], c = (*p)[(i + 2) % 3];
        for (std::size_t k = 0; k < 3; ++k) {
            if (q[k] == c && q[(k + 1) % 3] == b) {  // the shared edge runs the other way
                const Vec3f d = q[(k + 2) % 3];
                const float scale = std::max(MaxComponent(Abs(a)), MaxComponent(Abs(d)));
                if (!(MaxComponent(Abs(a + d - b - c)) <= kTolerance * scale)) {
                    return false;
                }
                *p = {a, b, c};
                return true;
            }
        }
    }
    return false;
}

}  // namespace

void LightSet::AddAreaLights(const Mesh& mesh, const Transform& to_world, std::uint32_t o,
                             const Object& object, std::vector<LightExtent>* extents,
                             Powers* powers) {
    const CompiledMaterial& material = materials_[object.material];
    const bool uniform = material.emissive_texture < 0 && !material.SeesThrough();
    const auto corners = [&](std::size_t i) {
        const Vec3u v = mesh.triangles[i];
        return std::array<Vec3f, 3>{to_world.Point(mesh.positions[v.x]),
                                    to_world.Point(mesh.positions[v.y]),
                                    to_world.Point(mesh.positions[v.z])};
    };
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto number = static_cast<std::uint32_t>(areas_.size());
        area_of_.push_back(number);
        std::array<Vec3f, 3> p = corners(i);
        AreaLight light;
        light.object = o;
        light.triangle = static_cast<std::uint32_t>(i);
        if (uniform && i + 1 < mesh.triangles.size() && MakeParallelogram(&p, corners(i + 1))) {
            light.parallelogram = 1;
            area_of_.push_back(number);
            ++i;
        }
        light.p0 = p[0];
        light.e1 = p[1] - p[0];
        light.e2 = p[2] - p[0];
        light.size = std::max({MaxComponent(Abs(light.e1)), MaxComponent(Abs(light.e2)),
                               MaxComponent(Abs(light.e2 - light.e1))});
        LightExtent extent;
        const Vec3f normal = Cross(light.e1, light.e2) * (object.mirrored ? -1.0f : 1.0f);
        const float length = Length(normal);
        const float area = light.parallelogram != 0 ? length : 0.5f * length;
        if (length > 0 && std::isfinite(1 / area)) {
            light.normal = normal / length;
            light.inverse_area = 1 / area;
            const TriangleData* data =
                object.triangles == nullptr ? nullptr : object.triangles + light.triangle;
            const float strength = area * MeanEmission(material, textures_, data);
            extent.strength = strength > 0 ? std::min(strength, kMostStrength) : 0;
            extent.axis = light.normal;
            extent.reach = kPi / 2;
            extent.both_sides = material.double_sided;
            extent.box.Add(light.p0);
            extent.box.Add(light.p0 + light.e1);
            extent.box.Add(light.p0 + light.e2);
            if (light.parallelogram != 0) {
                extent.box.Add(light.p0 + light.e1 + light.e2);
            }
            powers->placed +=
                static_cast<double>(extent.strength) * kPi * (material.double_sided ? 2 : 1);
        }
        areas_.push_back(light);
        extents->push_back(extent);
    }
}

std::optional<LightSample> LightSet::SampleArea(const AreaLight& light, Vec3f p, Vec2f u) const {
    const Object& object = accel_.objects()[light.object];
    const CompiledMaterial& material = materials_[object.material];
    const float height = Dot(light.normal, p - light.p0);  // of p over the light's front
    if (height == 0 || (height < 0 && !material.double_sided)) {
        return std::nullopt;
    }
    LightSample sample;
    Barycentric b{};
    float cosine = 0;
    if (const auto seen = light.SeenFrom(p)) {
        sample.wi = seen->Sample(u);
        cosine = std::abs(Dot(light.normal, sample.wi));
        if (!(cosine > 0)) {
            return std::nullopt;
        }
        sample.distance = std::abs(height) / cosine;
        sample.pdf = 1 / seen->solid_angle();
        if (object.triangles != nullptr) {
            const Vec3f at = p + sample.wi * sample.distance - light.p0;
            const Vec3f normal = Cross(light.e1, light.e2);
            const float scale = 1 / Length2(normal);
            b = {Dot(Cross(at, light.e2), normal) * scale,
                 Dot(Cross(light.e1, at), normal) * scale};
        }
    } else {
        b = light.parallelogram != 0 ? Barycentric{u.x, u.y} : SampleTriangle(u);
        const Vec3f to_light = light.p0 + light.e1 * b.b1 + light.e2 * b.b2 - p;
        const float distance2 = Length2(to_light);
        sample.distance = std::sqrt(distance2);
        sample.wi = to_light * (1 / sample.distance);
        cosine = std::abs(Dot(light.normal, sample.wi));
        if (!(cosine > 0)) {
            return std::nullopt;
        }
        sample.pdf = light.inverse_area * distance2 / cosine;
    }
    Vec2f uv;
    if (object.triangles != nullptr) {
        uv = object.triangles[light.triangle].Uv(b.b1, b.b2);
    }
    sample.radiance = Emission(material, textures_, uv);
    if (material.SeesThrough()) {  // a ray that comes by chance is stopped as often
        sample.radiance *= Opacity(material, textures_, uv);
    }
    const Vec3f q = p + sample.wi * sample.distance;
    const float coordinate = std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z), light.size});
    sample.clearance = std::min(coordinate * 0x1p-19f / cosine, 0.5f * sample.distance);
    return sample;
}

}  // namespace relume::render
