#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/film/tile.h"
#include "core/math/vec.h"

namespace relume {

// A camera of the job's own, in place of the scene's.
struct LookCamera {
    Vec3f from, at, up{0, 1, 0};  // world; `up` is up in the picture, of any length
    float fov = 40;               // degrees: full vertical angle, 1 to 175

    bool operator==(const LookCamera&) const = default;
};

// What beside the scene decides a sample's value: two jobs with equal settings and scene share
// every sample. Budgets, tile sizes and filters are not in here.
struct RenderSettings {
    int width = 0, height = 0;  // full frame; 1 to 65536 a side
    TileRect crop;              // part of it; empty = all
    std::uint32_t seed = 0;
    int max_depth = 8;   // path segments from the camera, at least 1; 1 = emission seen directly
    std::string camera;  // name or index in the scene; "" = first, or a fitted one
    std::optional<LookCamera> look;  // if set, instead of `camera`
    float lens_radius = -1;          // scene units; negative = the camera's own
    float focus_distance = -1;       // scene units; negative = the camera's own
    float time = -1;          // of the shutter's opening, s; negative = the scene's own (glTF: 0)
    float shutter = -1;       // how long it is open, s; negative = the scene's own (glTF: 0)
    std::string environment;  // name in the manifest; "" = the scene's own
    float environment_scale = 1;
    bool allow_black = false;  // render although nothing shines

    TileRect Window() const { return crop.empty() ? TileRect{0, 0, width, height} : crop; }
};

inline constexpr int kMaxDepth = 1024;
inline constexpr int kMaxImageSide = 65536;
inline constexpr std::int64_t kMaxImagePixels = std::int64_t{1} << 26;  // 64 MP: 11 GB of film

// Throws kInvalidArgument naming the setting and its range.
void ValidateSettings(const RenderSettings& settings);

}  // namespace relume
