#include "worker/render/integrator/path_tracer.h"

#include <algorithm>
#include <array>

#include "worker/render/sampler/batch.h"

namespace relume::render {

PathTracer::PathTracer(const Accel& accel, const std::vector<CompiledMaterial>& materials,
                       const TextureSet& textures, const LightSet& lights, const RayCamera& camera,
                       const RenderSettings& settings, const Box3f& bounds)
    : accel_(accel),
      materials_(materials),
      textures_(textures),
      lights_(lights),
      camera_(camera),
      seed_(settings.seed),
      max_depth_(settings.max_depth) {
    for (const CompiledMaterial& m : materials) {
        blends_ = blends_ || m.alpha_mode == AlphaMode::kBlend;
        chooses_ = chooses_ || m.Chooses();
        absorbs_ = absorbs_ || m.absorbs;
    }
    moves_ = accel.moves() || !camera.motion.empty();
    last_is_any_hit_ = !lights.has_emissive_surfaces();
    last_finds_nothing_ = last_is_any_hit_ && !lights.has_environment();
    if (!bounds.empty()) {
        center_ = bounds.center();
        radius_ = bounds.radius();
    }
}

std::uint64_t PathTracer::Trace(std::span<const SampleRequest> requests, std::span<Path> paths,
                                std::span<PixelSample> samples,
                                std::span<SampleRecord> records) const {
    std::uint64_t rays = 0;
    Randoms randoms;
    Places places;
    std::array<std::uint32_t, kWave> alive;
    std::size_t count = requests.size();
    for (std::size_t i = 0; i < count; ++i) {
        Start(requests[i], &paths[i]);
        if (!records.empty()) {
            paths[i].record = &records[i];
            BeginRecord(&paths[i]);
        }
        alive[i] = static_cast<std::uint32_t>(i);
    }
    // Each stage keeps the paths that go on at the front of `alive`.
    const auto keep = [&](auto&& stage) {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count; ++i) {
            if (stage(&paths[alive[i]])) {
                alive[kept++] = alive[i];
            }
        }
        count = kept;
    };
    for (int depth = 1; depth <= max_depth_ && count > 0; ++depth) {
        rays += count;
        std::array<std::uint32_t, kWave> left;
        std::size_t left_count = 0;
        keep([&](Path* path) {
            const Way way = Extend(path, depth);
            if (way == Way::kOut) {
                left[left_count++] = static_cast<std::uint32_t>(path - paths.data());
            }
            return way == Way::kOn;
        });
        LeaveAll({left.data(), left_count}, paths, &places);
        for (std::size_t i = 0; i < count; ++i) {
            PrefetchTextures(&paths[alive[i]]);
        }
        DrawRandoms({alive.data(), count}, paths, depth, &randoms);
        for (std::size_t i = 0; lights_.has_environment() && i < count; ++i) {
            if (lights_.ChoosesEnvironment(LightChoice(randoms, i))) {
                places[i] = lights_.DrawEnvironment({randoms.light_x[i], randoms.light_y[i]});
            }
        }
        std::array<std::uint32_t, kWave> shaded = alive;
        const std::size_t shaded_count = count;
        std::size_t row = 0;
        keep([&](Path* path) { return Shade(path, depth, randoms, places, row++); });
        for (std::size_t i = 0; i < shaded_count; ++i) {
            Path* path = &paths[shaded[i]];
            if (path->has_shadow_ray) {
                Connect(path);
                ++rays;
            }
        }
    }
    for (std::size_t i = 0; i < requests.size(); ++i) {
        const Path& path = paths[i];
        samples[i].radiance = path.direct + path.indirect;
        samples[i].indirect_luminance = Luminance(path.indirect);
        samples[i].features = path.features;
        if (!records.empty()) {
            records[i].radiance = samples[i].radiance;
        }
    }
    return rays;
}

void PathTracer::Start(const SampleRequest& request, Path* path) const {
    *path = Path();
    path->sampler = Sampler(seed_, request.x, request.y, request.index);
    const Vec2f in_pixel = path->sampler.Pair(kPixelDimension);
    const Vec2f lens = camera_.lens_radius > 0 ? path->sampler.Pair(kLensDimension) : Vec2f{};
    const CameraRay ray = camera_.Generate(
        {static_cast<float>(request.x) + in_pixel.x, static_cast<float>(request.y) + in_pixel.y},
        lens);
    path->origin = ray.origin;
    path->direction = ray.direction;
    if (moves_) {
        path->time = path->sampler.One(kTimeDimension);
        if (!camera_.motion.empty()) {
            const CameraRay moved = camera_.MoveTo(path->time, ray);
            path->origin = moved.origin;
            path->direction = moved.direction;
        }
    }
}

// The random numbers of the sample. A pinhole leaves room for those of the first direction, which
// most of the noise is of.
void PathTracer::BeginRecord(Path* path) const {
    SampleRecord* record = path->record;
    const Vec2f in_pixel = path->sampler.Pair(kPixelDimension);
    record->x = in_pixel.x;
    record->y = in_pixel.y;
    if (camera_.lens_radius > 0) {
        const Vec2f lens = path->sampler.Pair(kLensDimension);
        record->random[0] = lens.x;
        record->random[1] = lens.y;
    } else {
        const Vec2f direction = path->sampler.Pair(VertexBase(1) + kDirectionDimension);
        record->random[0] = direction.x;
        record->random[1] = direction.y;
    }
    record->random[2] = path->time;
    if (!lights_.none_to_sample()) {
        const Vec2f light = path->sampler.Pair(VertexBase(1) + kLightDimension);
        record->random[3] = light.x;
        record->random[4] = light.y;
    }
}

PathTracer::Way PathTracer::Extend(Path* path, int depth) const {
    Ray ray;
    ray.origin = path->origin;
    ray.direction = path->direction;
    ray.time = path->time;
    if (blends_) {
        ray.seed = path->sampler.Bits(VertexBase(depth) + kRayDimension);
    }
    if (depth == max_depth_ && last_is_any_hit_ && !path->features_open) {
        return accel_.Occluded(ray) ? Way::kEnd : Way::kOut;
    }
    return accel_.Intersect(ray, &path->hit) ? Way::kOn : Way::kOut;
}

void PathTracer::PrefetchTextures(Path* path) const {
    const Object& object = accel_.objects()[path->hit.object];
    path->uv = HitUv(object, path->hit);
    const CompiledMaterial& m = materials_[object.material];
    if (m.pack >= 0) {
        textures_.PrefetchPack(m.pack, path->uv);
        return;
    }
    for (const TextureId id :
         {m.base_color_texture, m.metallic_roughness_texture, m.normal_texture}) {
        if (id >= 0) {
            textures_.Prefetch(id, path->uv);
        }
    }
}

void PathTracer::DrawRandoms(std::span<const std::uint32_t> alive, std::span<const Path> paths,
                             int depth, Randoms* randoms) const {
    const std::size_t n = alive.size();
    SamplerBatch<kWave> batch;
    for (std::size_t i = 0; i < n; ++i) {
        batch.Set(i, paths[alive[i]].sampler);
    }
    const std::uint32_t base = VertexBase(depth);
    batch.Pairs(base + kDirectionDimension, n, randoms->direction_x, randoms->direction_y);
    if (!lights_.none_to_sample()) {
        batch.Pairs(base + kLightDimension, n, randoms->light_x, randoms->light_y);
        if (!lights_.single()) {
            batch.OneBits(base + kLightChoiceDimension, n, randoms->light_choice);
        }
    }
    if (chooses_) {
        batch.OneBits(base + kLobeChoiceDimension, n, randoms->lobe_choice);
    }
    if (depth >= kFirstRoulette) {
        batch.Bits(base + kRouletteDimension, n, randoms->roulette);
    }
}

void PathTracer::LeaveAll(std::span<const std::uint32_t> left, std::span<Path> paths,
                          Places* places) const {
    if (lights_.has_environment()) {
        for (std::size_t i = 0; i < left.size(); ++i) {
            (*places)[i] = lights_.FindEnvironment(paths[left[i]].direction);
        }
    }
    for (std::size_t i = 0; i < left.size(); ++i) {
        Leave((*places)[i], &paths[left[i]]);
    }
}

void PathTracer::Leave(const EnvironmentLight::Place& place, Path* path) const {
    Rgb radiance;
    if (lights_.has_environment()) {
        float pdf = 0;
        radiance = lights_.Environment(place, path->pdf > 0 ? &pdf : nullptr);
        const float weight = path->pdf > 0 ? PowerHeuristic(path->pdf, pdf) : 1;
        (path->from_camera ? path->direct : path->indirect) += path->throughput * radiance * weight;
    }
    if (path->features_open) {
        const Rgb albedo = Min(radiance, {1, 1, 1}) * path->throughput * path->eta_scale;
        const float far = Length(path->origin - center_) + radius_;
        if (path->record != nullptr && path->length == 0) {
            path->record->hits[0] = {
                path->origin + path->direction * far, {}, Min(radiance, {1, 1, 1})};
        }
        path->features = {albedo.x, albedo.y, albedo.z, 0, 0, 0, path->length + far, 0};
    }
}

void PathTracer::Connect(Path* path) const {
    if (accel_.Occluded(path->shadow_ray)) {
        return;
    }
    path->indirect += path->shadow_radiance;
    if (path->shadow_is_feature) {
        path->features[kVisibility] = 1;
    }
}

}  // namespace relume::render
