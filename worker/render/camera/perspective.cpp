// Camera "perspective": yfov [0.7] (radians, full vertical angle), or xfov instead; the other
// follows from the image's shape. aspect_ratio advises on that shape and is not used. Thin lens:
// lens_radius [0], focus_distance [1] (scene units; the settings may override both).
#include <fmt/format.h>

#include <cmath>

#include "core/base/error.h"
#include "worker/render/bsdf/params.h"
#include "worker/render/camera/ray_camera.h"

namespace relume::render {

RayCamera MakePerspective(const ParamSet& params, const RenderSettings& settings) {
    RayCamera camera;
    constexpr float kLeast = 1e-4f, kMost = kPi - 1e-3f;
    const float aspect = static_cast<float>(settings.width) / static_cast<float>(settings.height);
    const float yfov = ReadInRange(params, "yfov", 0.7f, kLeast, kMost);
    params.GetFloat("aspect_ratio", aspect);
    if (params.Has("xfov")) {
        camera.half_width = std::tan(0.5f * ReadInRange(params, "xfov", 0.7f, kLeast, kMost));
        camera.half_height = camera.half_width / aspect;
    } else {
        camera.half_height = std::tan(0.5f * yfov);
        camera.half_width = camera.half_height * aspect;
    }
    camera.lens_radius = params.GetFloat("lens_radius", 0);
    camera.focus_distance = params.GetFloat("focus_distance", 1);
    if (settings.lens_radius >= 0) {
        camera.lens_radius = settings.lens_radius;
    }
    if (settings.focus_distance >= 0) {
        camera.focus_distance = settings.focus_distance;
    }
    if (camera.lens_radius > 0 && !(camera.focus_distance > 0)) {
        ThrowInvalidArgument(
            fmt::format("focus_distance {} must be above 0", camera.focus_distance));
    }
    return camera;
}

}  // namespace relume::render
