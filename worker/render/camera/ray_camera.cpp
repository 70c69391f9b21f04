#include "worker/render/camera/ray_camera.h"

#include "worker/render/sampler/warp.h"

namespace relume::render {

CameraRay RayCamera::Generate(Vec2f film, Vec2f lens) const {
    const float x = (2 * film.x / static_cast<float>(width) - 1) * half_width;
    const float y = (1 - 2 * film.y / static_cast<float>(height)) * half_height;
    if (orthographic) {
        return {origin + right * x + up * y, forward};
    }
    const Vec3f through = right * x + up * y + forward;  // point of the image plane at distance 1
    if (lens_radius <= 0) {
        return {origin, Normalize(through)};
    }
    const Vec2f disk = SampleDisk(lens) * lens_radius;
    const Vec3f offset = right * disk.x + up * disk.y;
    return {origin + offset, Normalize(through * focus_distance - offset)};
}

}  // namespace relume::render
