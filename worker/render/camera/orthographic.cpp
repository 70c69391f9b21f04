// Camera "orthographic": ymag [1], half the height of what is seen, in scene units; the width
// follows from the image's shape. xmag is used only if ymag is absent; mag_short, half the shorter
// side, goes before both. screen_window x_min x_max y_min y_max (scene units) instead of all: what
// is seen, stretched to the image's shape. Lens: ReadLens.
#include <algorithm>

#include "worker/render/bsdf/params.h"
#include "worker/render/camera/ray_camera.h"

namespace relume::render {

RayCamera MakeOrthographic(const ParamSet& params, const RenderSettings& settings) {
    constexpr float kLeast = 1e-6f, kMost = 1e9f;
    RayCamera camera;
    camera.orthographic = true;
    const float aspect = static_cast<float>(settings.width) / static_cast<float>(settings.height);
    const float xmag = ReadInRange(params, "xmag", 1, kLeast, kMost);
    const float ymag = ReadInRange(params, "ymag", 1, kLeast, kMost);
    params.GetFloat("aspect_ratio", aspect);
    float half_height = params.Has("ymag") || !params.Has("xmag") ? ymag : xmag / aspect;
    if (params.Has("mag_short")) {
        half_height = ReadInRange(params, "mag_short", 1, kLeast, kMost) / std::min(1.0f, aspect);
    }
    camera.window = ReadScreenWindow(params, half_height * aspect, half_height, 1);
    ReadLens(params, settings, &camera);
    return camera;
}

}  // namespace relume::render
