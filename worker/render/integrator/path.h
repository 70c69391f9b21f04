#pragma once

#include <array>

#include "core/film/aov.h"
#include "core/film/sample_records.h"
#include "worker/render/accel/accel.h"
#include "worker/render/light/light_bounds.h"
#include "worker/render/sampler/sampler.h"

namespace relume::render {

// Random dimensions of a path: pairs, see Sampler. Those of a vertex follow those of the vertex
// before.
enum CameraDimension : std::uint32_t { kPixelDimension, kLensDimension, kFirstVertexDimension };
// Apart from all others: what stands still draws the same numbers as if nothing moved.
constexpr std::uint32_t kTimeDimension = 0xffffffffu;
enum VertexDimension : std::uint32_t {
    kLightDimension,
    kDirectionDimension,
    kLightChoiceDimension,
    kLobeChoiceDimension,
    kRouletteDimension,
    kRayDimension,     // partly transparent surfaces on the way to the vertex
    kShadowDimension,  // and on the way to the light
    kMixDimension,
    kVertexDimensions,
};

inline std::uint32_t VertexBase(int depth) {
    return kFirstVertexDimension + static_cast<std::uint32_t>(depth - 1) * kVertexDimensions;
}

// Random numbers of one vertex of each path of a wave; rows as in the list of paths alive.
template <std::size_t kSize>
struct VertexRandoms {
    alignas(32) float light_x[kSize];
    alignas(32) float light_y[kSize];
    alignas(32) float direction_x[kSize];
    alignas(32) float direction_y[kSize];
    alignas(32) std::uint32_t light_choice[kSize];
    alignas(32) std::uint32_t lobe_choice[kSize];
    alignas(32) std::uint32_t roulette[kSize];
};

// A path on its way, between two stages of a wave.
struct Path {
    Sampler sampler;
    // The ray to the next vertex. `direction` has unit length.
    Vec3f origin, direction;
    float time = 0;  // in [0, 1]: 0 is when the shutter opens, and always if nothing moves
    Rgb throughput{1, 1, 1};
    float pdf = 0;        // density of `direction`; 0: perfectly specular, or from the camera
    LightReceiver from;   // where `direction` was drawn: lights might have been sampled there
    float eta_scale = 1;  // undoes the radiance scaling of refractions in `throughput`
    // Radiance so far: emission that the camera sees directly, and all other.
    Rgb direct, indirect;
    bool from_camera = true;  // the ray
    Rgb absorption;           // of what the ray runs through, per scene unit

    // Features (core/film/aov.h) are overwritten at each vertex while they are open.
    bool features_open = true;
    float length = 0;
    std::array<float, kFeatureCount> features{};

    SampleRecord* record = nullptr;  // where to note what is met; null: nowhere

    Hit hit;
    Vec2f uv;
    // What a light adds if nothing is in the way.
    bool has_shadow_ray = false, shadow_is_feature = false;
    Ray shadow_ray;
    Rgb shadow_radiance;
};

}  // namespace relume::render
