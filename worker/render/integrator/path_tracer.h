#pragma once

#include <span>
#include <vector>

#include "core/film/moments.h"
#include "worker/render/accel/surface.h"
#include "worker/render/camera/ray_camera.h"
#include "worker/render/integrator/path.h"
#include "worker/render/light/light_set.h"

namespace relume::render {

// One sample to take: a pixel of the full frame and its global sample index.
struct SampleRequest {
    int x = 0, y = 0;
    std::uint32_t index = 0;
};

// Path tracing with next-event estimation: at each vertex one light is sampled and one direction,
// weighted against each other by the power heuristic (Veach 1997); Russian roulette by throughput.
// Paths go in waves, stage by stage, so that the memory that one path waits for arrives while the
// others compute; they don't touch each other, so that how they are grouped does not show in any
// bit. Immutable, thread-safe.
class PathTracer {
  public:
    // Keeps references to all but `settings`.
    PathTracer(const Accel& accel, const std::vector<CompiledMaterial>& materials,
               const TextureSet& textures, const LightSet& lights, const RayCamera& camera,
               const RenderSettings& settings, const Box3f& bounds);

    // At most kWave requests; `paths` is scratch of as many. Returns the number of rays traced.
    // `records`: as many, blank, to be filled, or none.
    std::uint64_t Trace(std::span<const SampleRequest> requests, std::span<Path> paths,
                        std::span<PixelSample> samples, std::span<SampleRecord> records = {}) const;

    static constexpr std::size_t kWave = 64;

  private:
    // Russian roulette begins at this vertex. A path survives by the root of its throughput, so
    // that none comes out of dark surfaces with many times its weight (docs/adr, roulette).
    static constexpr int kFirstRoulette = 3;

    using Randoms = VertexRandoms<kWave>;
    using Places = std::array<EnvironmentLight::Place, kWave>;  // in the environment

    void Start(const SampleRequest& request, Path* path) const;
    // Finds the next vertex, or that the path ends, in the environment or at nothing that matters.
    enum class Way { kOn, kOut, kEnd };
    Way Extend(Path* path, int depth) const;
    // Finds the texture coordinates of the hit and asks the memory for the texels.
    void PrefetchTextures(Path* path) const;
    // What Shade will need.
    void DrawRandoms(std::span<const std::uint32_t> alive, std::span<const Path> paths, int depth,
                     Randoms* randoms) const;
    // For the paths that left the scene: their directions' places in the map first, then its light.
    void LeaveAll(std::span<const std::uint32_t> left, std::span<Path> paths, Places* places) const;
    void Leave(const EnvironmentLight::Place& place, Path* path) const;
    std::uint32_t LightChoice(const Randoms& randoms, std::size_t row) const;
    // Emission, features, light, and the next direction. False if the path has ended.
    bool Shade(Path* path, int depth, const Randoms& randoms, const Places& places,
               std::size_t row) const;
    void AddEmission(const Surface& surface, const CompiledMaterial& material, Path* path) const;
    void BeginRecord(Path* path) const;
    void RecordHit(const Surface& surface, const Bsdf& bsdf, int depth, Path* path) const;
    void WriteFeatures(const Surface& surface, const Bsdf& bsdf, Path* path) const;
    void SampleLight(const Surface& surface, const CompiledMaterial& material, const Bsdf& bsdf,
                     int depth, const Randoms& randoms, const EnvironmentLight::Place& drawn,
                     std::size_t row, Path* path) const;
    bool SampleDirection(const Surface& surface, const CompiledMaterial& material, const Bsdf& bsdf,
                         int depth, const Randoms& randoms, std::size_t row, Path* path) const;
    void Connect(Path* path) const;

    const Accel& accel_;
    const std::vector<CompiledMaterial>& materials_;
    const TextureSet& textures_;
    const LightSet& lights_;
    const RayCamera& camera_;
    std::uint32_t seed_;
    int max_depth_;
    bool moves_ = false;               // something does, or the camera: paths have a time
    bool blends_ = false;              // some surface is partly transparent
    bool chooses_ = false;             // some surface draws a lobe apart from its direction
    bool absorbs_ = false;             // some glass absorbs
    bool last_is_any_hit_ = false;     // the last segment can only find the environment
    bool last_finds_nothing_ = false;  // not even that
    Vec3f center_;                     // of the scene's bounding sphere
    float radius_ = 0;
};

}  // namespace relume::render
