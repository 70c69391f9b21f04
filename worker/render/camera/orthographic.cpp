// Camera "orthographic": ymag [1], half the height of what is seen, in scene units; the width
// follows from the image's shape. xmag is used only if ymag is absent.
#include "worker/render/bsdf/params.h"
#include "worker/render/camera/ray_camera.h"

namespace relume::render {

RayCamera MakeOrthographic(const ParamSet& params, const RenderSettings& settings) {
    RayCamera camera;
    camera.orthographic = true;
    const float aspect = static_cast<float>(settings.width) / static_cast<float>(settings.height);
    const float xmag = ReadInRange(params, "xmag", 1, 1e-6f, 1e9f);
    const float ymag = ReadInRange(params, "ymag", 1, 1e-6f, 1e9f);
    params.GetFloat("aspect_ratio", aspect);
    camera.half_height = params.Has("ymag") || !params.Has("xmag") ? ymag : xmag / aspect;
    camera.half_width = camera.half_height * aspect;
    return camera;
}

}  // namespace relume::render
