// Camera "perspective": yfov [0.7] (radians, full vertical angle), or xfov instead, or fov_short
// (along the image's shorter side) instead; the other follows from the image's shape. aspect_ratio
// advises on that shape and is not used. screen_window x_min x_max y_min y_max: what is seen, in
// units of the shorter side's half extent as the angle gives it; stretched to the image's shape.
// Lens: ReadLens.
#include <algorithm>
#include <cmath>

#include "worker/render/bsdf/params.h"
#include "worker/render/camera/ray_camera.h"

namespace relume::render {

RayCamera MakePerspective(const ParamSet& params, const RenderSettings& settings) {
    RayCamera camera;
    constexpr float kLeast = 1e-4f, kMost = kPi - 1e-3f;
    const float aspect = static_cast<float>(settings.width) / static_cast<float>(settings.height);
    const float yfov = ReadInRange(params, "yfov", 0.7f, kLeast, kMost);
    params.GetFloat("aspect_ratio", aspect);
    float half_height = std::tan(0.5f * yfov);
    if (params.Has("xfov")) {
        half_height = std::tan(0.5f * ReadInRange(params, "xfov", 0.7f, kLeast, kMost)) / aspect;
    }
    if (params.Has("fov_short")) {
        half_height = std::tan(0.5f * ReadInRange(params, "fov_short", 0.7f, kLeast, kMost)) /
                      std::min(1.0f, aspect);
    }
    camera.window = ReadScreenWindow(params, half_height * aspect, half_height,
                                     half_height * std::min(1.0f, aspect));
    ReadLens(params, settings, &camera);
    return camera;
}

}  // namespace relume::render
