#include <cmath>

#include "core/base/error.h"
#include "worker/render/camera/ray_camera.h"
#include "worker/render/compile_by_type.h"

namespace relume::render {

RayCamera MakePerspective(const ParamSet& params, const RenderSettings& settings);
RayCamera MakeOrthographic(const ParamSet& params, const RenderSettings& settings);

namespace {

struct Entry {
    const char* type;
    RayCamera (*make)(const ParamSet& params, const RenderSettings& settings);
};

constexpr Entry kCameras[] = {
    {"perspective", MakePerspective},
    {"orthographic", MakeOrthographic},
};

}  // namespace

RayCamera CompileCamera(const Camera& camera, const RenderSettings& settings) {
    return CompileByType(
        "camera", camera, kCameras, [&](const Entry& entry, const ParamSet& params) {
            RayCamera compiled = entry.make(params, settings);
            compiled.width = settings.width;
            compiled.height = settings.height;
            const CameraAxes axes =
                AxesOf(camera.motion.empty() ? camera.to_world : camera.motion.front());
            compiled.origin = axes.origin;
            compiled.right = axes.right;
            compiled.up = axes.up;
            compiled.forward = axes.forward;
            compiled.motion = camera.motion;
            if (!IsFinite(compiled.origin) || !IsFinite(compiled.right) || !IsFinite(compiled.up) ||
                !IsFinite(compiled.forward)) {
                ThrowInvalidArgument("its transform is not finite or has a scale of 0");
            }
            return compiled;
        });
}

Camera ChooseCamera(const Scene& scene, const Box3f& bounds, const RenderSettings& settings,
                    std::vector<std::string>* notes) {
    if (settings.look) {
        return MakeLookCamera(*settings.look);
    }
    if (const Camera* camera = FindCamera(scene, settings.camera)) {
        return *camera;
    }
    notes->push_back("the scene has no camera: one that sees all of it was fitted");
    return FitCamera(bounds, scene.name,
                     static_cast<float>(settings.width) / static_cast<float>(settings.height));
}

}  // namespace relume::render
