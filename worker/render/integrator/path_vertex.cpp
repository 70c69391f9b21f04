// What happens where a path meets a surface: its light, features, a light sampled, a direction.
#include <algorithm>

#include "worker/render/integrator/path_tracer.h"
#include "worker/render/sampler/elementary.h"

namespace relume::render {
namespace {

// Shadow rays end this much short of their light, relative to its distance, at least.
constexpr float kShadowGap = 1e-5f;

bool IsBlack(Rgb c) { return c.x == 0 && c.y == 0 && c.z == 0; }

// What is left of light over a distance (Beer and Lambert).
Rgb Transmittance(Rgb absorption, float distance) {
    return {Exp(-absorption.x * distance), Exp(-absorption.y * distance),
            Exp(-absorption.z * distance)};
}

// Absorption on the other side of the surface of a solid, coming from `front` or back.
Rgb AbsorptionBeyond(const Surface& surface, const CompiledMaterial& material) {
    return surface.at.front ? material.absorption : Rgb{};
}

}  // namespace

std::uint32_t PathTracer::LightChoice(const Randoms& randoms, std::size_t row) const {
    return lights_.single() ? 0 : randoms.light_choice[row];
}

bool PathTracer::Shade(Path* path, int depth, const Randoms& randoms, const Places& places,
                       std::size_t row) const {
    path->has_shadow_ray = false;
    path->shadow_is_feature = false;
    const Object& object = accel_.objects()[path->hit.object];
    const CompiledMaterial& material = materials_[object.material];
    SurfaceTexels packed;
    const SurfaceTexels* texels = nullptr;
    if (material.pack >= 0) {
        packed = textures_.LookupPack(material.pack, path->uv);
        texels = &packed;
    }
    const Surface surface = MakeSurface(object, path->hit, path->origin, path->direction, path->uv,
                                        material, textures_, texels);
    if (absorbs_) {
        path->throughput *= Transmittance(path->absorption, path->hit.t);
    }
    AddEmission(surface, material, path);
    if (depth == max_depth_ && !path->features_open) {
        return false;
    }
    const CompiledMaterial& part =
        material.model != Model::kMix
            ? material
            : ResolveMix(material, materials_, textures_, surface.uv,
                         path->sampler.Bits(VertexBase(depth) + kMixDimension));
    const Bsdf bsdf(part, textures_, surface.uv, surface.at, -path->direction, texels);
    if (path->record != nullptr && depth <= 2) {
        RecordHit(surface, bsdf, depth, path);
    }
    if (path->features_open) {
        WriteFeatures(surface, bsdf, path);
    }
    if (depth == max_depth_) {
        return false;
    }
    path->from = {surface.point, bsdf.normal(), part.Transmits()};
    if (bsdf.HasSmoothLobe() && !lights_.none_to_sample()) {
        SampleLight(surface, part, bsdf, depth, randoms, places[row], row, path);
    }
    if (depth + 1 == max_depth_ && last_finds_nothing_ && !path->features_open) {
        return false;
    }
    return SampleDirection(surface, part, bsdf, depth, randoms, row, path);
}

void PathTracer::AddEmission(const Surface& surface, const CompiledMaterial& material,
                             Path* path) const {
    if (!material.IsEmissive() || !(surface.at.front || material.double_sided)) {
        return;
    }
    float weight = 1;
    const Object& object = accel_.objects()[path->hit.object];
    if (path->pdf > 0 && object.first_light >= 0) {
        weight = PowerHeuristic(path->pdf,
                                lights_.AreaPdf(path->from, object, path->hit.triangle, path->hit.t,
                                                path->direction, path->hit.normal));
    }
    (path->from_camera ? path->direct : path->indirect) +=
        path->throughput * Emission(material, textures_, surface.uv) * weight;
}

void PathTracer::RecordHit(const Surface& surface, const Bsdf& bsdf, int depth, Path* path) const {
    path->record->hits[depth - 1] = {surface.point, surface.at.frame.z, bsdf.albedo()};
}

void PathTracer::WriteFeatures(const Surface& surface, const Bsdf& bsdf, Path* path) const {
    path->length += path->hit.t;
    const Rgb albedo = bsdf.albedo() * path->throughput * path->eta_scale;
    const Vec3f n = surface.at.frame.z;
    path->features = {albedo.x, albedo.y, albedo.z, n.x, n.y, n.z, path->length, 0};
    path->features_open = bsdf.IsNearSpecular();
    path->shadow_is_feature = !path->features_open;
}

void PathTracer::SampleLight(const Surface& surface, const CompiledMaterial& material,
                             const Bsdf& bsdf, int depth, const Randoms& randoms,
                             const EnvironmentLight::Place& drawn, std::size_t row,
                             Path* path) const {
    const auto light = lights_.Sample(path->from, LightChoice(randoms, row),
                                      {randoms.light_x[row], randoms.light_y[row]}, &drawn);
    if (!light) {
        return;
    }
    const BsdfValue value = bsdf.Evaluate(light->wi);
    if (IsBlack(value.f)) {
        return;
    }
    const float weight = light->delta ? 1 : PowerHeuristic(light->pdf, value.pdf);
    const float cosine = std::abs(Dot(surface.at.frame.z, light->wi));
    path->shadow_radiance =
        path->throughput * value.f * light->radiance * (cosine * weight / light->pdf);
    if (IsBlack(path->shadow_radiance)) {
        return;
    }
    if (absorbs_ && !std::isinf(light->distance)) {
        const bool crosses = Dot(light->wi, surface.at.geometric) < 0 && !material.thin;
        path->shadow_radiance *= Transmittance(
            crosses ? AbsorptionBeyond(surface, material) : path->absorption, light->distance);
    }
    path->has_shadow_ray = true;
    Ray& ray = path->shadow_ray;
    ray.time = path->time;
    ray.origin = surface.Leave(light->wi);
    if (std::isinf(light->distance)) {
        ray.direction = light->wi;
        ray.far = light->distance;
    } else {
        ray.direction = surface.point + light->wi * light->distance - ray.origin;
        ray.far = 1 - std::max(kShadowGap, light->clearance / light->distance);
    }
    ray.seed = blends_ ? path->sampler.Bits(VertexBase(depth) + kShadowDimension) : 0;
}

bool PathTracer::SampleDirection(const Surface& surface, const CompiledMaterial& material,
                                 const Bsdf& bsdf, int depth, const Randoms& randoms,
                                 std::size_t row, Path* path) const {
    const float choice = bsdf.NeedsChoice() ? ToUnit(randoms.lobe_choice[row]) : 0;
    const auto next = bsdf.Sample({randoms.direction_x[row], randoms.direction_y[row]}, choice);
    if (!next) {
        return false;
    }
    path->throughput *= next->weight;
    path->eta_scale *= next->eta2;
    path->pdf = next->pdf;
    path->from_camera = false;
    path->origin = surface.Leave(next->wi);
    path->direction = next->wi;
    if (IsBlack(path->throughput)) {
        return false;
    }
    if (absorbs_ && next->transmitted && !material.thin) {
        path->absorption = AbsorptionBeyond(surface, material);
    }
    if (depth >= kFirstRoulette) {
        const float survival = std::sqrt(MaxComponent(path->throughput) * path->eta_scale);
        if (survival < 1) {
            if (ToUnit(randoms.roulette[row]) >= survival) {
                return false;
            }
            path->throughput *= 1 / survival;
        }
    }
    return true;
}

}  // namespace relume::render
