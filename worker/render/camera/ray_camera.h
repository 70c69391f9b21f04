#pragma once

#include <string>
#include <vector>

#include "core/scene/render_settings.h"
#include "core/scene/scene.h"

namespace relume::render {

struct CameraRay {
    Vec3f origin, direction;  // unit length
};

// A camera for one image size, as plain data. The pixel filter is a box: every sample lies in its
// own pixel.
struct RayCamera {
    Vec3f origin, right, up, forward;  // unit length; scale of the camera's node does not matter
    float half_width = 1,
          half_height = 1;  // of the image plane: at distance 1, or in scene units (orthographic)
    bool orthographic = false;
    float lens_radius = 0, focus_distance = 1;  // scene units; radius 0: pinhole
    int width = 1, height = 1;                  // pixels

    // `film` in pixels from the upper left corner of the full frame; `lens` in [0, 1)^2, read only
    // if there is one.
    CameraRay Generate(Vec2f film, Vec2f lens) const;
};

// Reads a camera. Throws kInvalidArgument naming the camera for an unknown type or parameter.
RayCamera CompileCamera(const Camera& camera, const RenderSettings& settings);

// The camera that the settings name: by name, by index, or "" for the first; a fitted one, with a
// note, if the scene has none. Throws kNotFound listing the cameras.
Camera ChooseCamera(const Scene& scene, const RenderSettings& settings,
                    std::vector<std::string>* notes);

}  // namespace relume::render
