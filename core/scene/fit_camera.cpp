#include <algorithm>
#include <cmath>

#include "core/scene/render_settings.h"
#include "core/scene/scene.h"

namespace relume {

Camera FitCamera(const Box3f& box, const std::string& scene_name, float aspect) {
    constexpr float kYfov = 40 * kPi / 180;
    constexpr float kMargin = 1.05f;
    const Vec3f toward_eye = Normalize(Vec3f{0.35f, 0.3f, 1});

    // The nearest place on that line from which each corner of the scene's box is in the picture:
    // a corner (x, y, z) of a camera at distance d is seen if |y| <= (d - z) tan(yfov / 2).
    const Vec3f center = box.empty() ? Vec3f{} : box.center();
    const Vec3f half = box.empty() ? Vec3f{1, 1, 1} : (box.upper - box.lower) * 0.5f;
    const Vec3f x = Normalize(Cross({0, 1, 0}, toward_eye)), y = Cross(toward_eye, x);
    const float tan_y = std::tan(kYfov / 2), tan_x = tan_y * aspect;
    float distance = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3f p{(corner & 1) != 0 ? half.x : -half.x, (corner & 2) != 0 ? half.y : -half.y,
                      (corner & 4) != 0 ? half.z : -half.z};
        const float sideways =
            std::max(std::abs(Dot(p, x)) / tan_x, std::abs(Dot(p, y)) / tan_y) * kMargin;
        distance = std::max(distance, Dot(p, toward_eye) + sideways);
    }

    Camera camera;
    camera.name = "fitted";
    camera.type = "perspective";
    camera.params.Set("yfov", kYfov);
    camera.to_world = Transform::LookAt(center + toward_eye * distance, center, {0, 1, 0});
    camera.source = scene_name + ": fitted camera";
    return camera;
}

Camera MakeLookCamera(const LookCamera& look) {
    Camera camera;
    camera.name = "look";
    camera.type = "perspective";
    camera.params.Set("yfov", look.fov * (kPi / 180));
    camera.to_world = Transform::LookAt(look.from, look.at, look.up);
    camera.source = "the camera given by look from and look at";
    return camera;
}

}  // namespace relume
