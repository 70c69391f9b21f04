#include "worker/render/camera/ray_camera.h"

#include <fmt/format.h>

#include <cmath>

#include "core/base/error.h"
#include "core/math/keys.h"
#include "worker/render/sampler/warp.h"

namespace relume::render {

CameraRay RayCamera::Generate(Vec2f film, Vec2f lens) const {
    const float x =
        window.x_min + (window.x_max - window.x_min) * (film.x / static_cast<float>(width));
    const float y =
        window.y_max - (window.y_max - window.y_min) * (film.y / static_cast<float>(height));
    // Where the chief ray begins, and its way to the image plane or as far as that.
    const Vec3f in_plane = right * x + up * y;
    const Vec3f start = orthographic ? origin + in_plane : origin;
    const Vec3f through = orthographic ? forward : in_plane + forward;
    if (lens_radius <= 0) {
        return {start, orthographic ? through : Normalize(through)};
    }
    const Vec2f disk = SampleDisk(lens) * lens_radius;
    const Vec3f offset = right * disk.x + up * disk.y;
    return {start + offset, Normalize(through * focus_distance - offset)};
}

ScreenWindow ReadScreenWindow(const ParamSet& params, float half_width, float half_height,
                              float unit) {
    if (!params.Has("screen_window")) {
        return {-half_width, half_width, -half_height, half_height};
    }
    const std::vector<float> w = params.GetFloats("screen_window", {});
    if (w.size() != 4 || !(w[0] < w[1]) || !(w[2] < w[3]) || !std::isfinite(w[1] - w[0]) ||
        !std::isfinite(w[3] - w[2])) {
        ThrowInvalidArgument(
            "parameter 'screen_window' must be 4 numbers, x_min < x_max and y_min < y_max");
    }
    return {w[0] * unit, w[1] * unit, w[2] * unit, w[3] * unit};
}

void ReadLens(const ParamSet& params, const RenderSettings& settings, RayCamera* camera) {
    camera->lens_radius = params.GetFloat("lens_radius", 0);
    camera->focus_distance = params.GetFloat("focus_distance", 1);
    if (settings.lens_radius >= 0) {
        camera->lens_radius = settings.lens_radius;
    }
    if (settings.focus_distance >= 0) {
        camera->focus_distance = settings.focus_distance;
    }
    if (camera->lens_radius > 0 && !(camera->focus_distance > 0)) {
        ThrowInvalidArgument(
            fmt::format("focus_distance {} must be above 0", camera->focus_distance));
    }
}

CameraRay RayCamera::MoveTo(float time, const CameraRay& ray) const {
    const CameraAxes axes = AxesOf(Interpolate(motion, time));
    const auto turn = [&](Vec3f v) {
        return axes.right * Dot(right, v) + axes.up * Dot(up, v) + axes.forward * Dot(forward, v);
    };
    return {axes.origin + turn(ray.origin - origin), Normalize(turn(ray.direction))};
}

CameraAxes AxesOf(const Transform& to_world) {
    return {to_world.Point({0, 0, 0}), Normalize(to_world.Vector({1, 0, 0})),
            Normalize(to_world.Vector({0, 1, 0})), Normalize(to_world.Vector({0, 0, -1}))};
}

}  // namespace relume::render
