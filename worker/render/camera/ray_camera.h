#pragma once

#include <string>
#include <vector>

#include "core/scene/render_settings.h"
#include "core/scene/scene.h"

namespace relume::render {

struct CameraRay {
    Vec3f origin, direction;  // unit length
};

// Where a camera is and looks: its axes have unit length, at right angles.
struct CameraAxes {
    Vec3f origin, right, up, forward;
};
CameraAxes AxesOf(const Transform& to_world);

// What a camera sees of its image plane: at distance 1, or in scene units (orthographic); y up.
struct ScreenWindow {
    float x_min = -1, x_max = 1, y_min = -1, y_max = 1;
};

// A camera for one image size, as plain data. The pixel filter is a box: every sample lies in its
// own pixel.
struct RayCamera {
    // Unit length; scale of the camera's node does not matter, and its mirroring stays: the frame
    // may be left-handed.
    Vec3f origin, right, up, forward;
    ScreenWindow window;
    bool orthographic = false;
    float lens_radius = 0, focus_distance = 1;  // scene units; radius 0: pinhole
    int width = 1, height = 1;                  // pixels

    std::vector<Transform>
        motion;  // camera to world at keys, as Camera::motion; the first is above

    // `film` in pixels from the upper left corner of the full frame; `lens` in [0, 1)^2, read only
    // if there is one.
    CameraRay Generate(Vec2f film, Vec2f lens) const;
    // Of a camera that moves: what Generate gave, as seen at a time in [0, 1].
    CameraRay MoveTo(float time, const CameraRay& ray) const;
};

// The parameter screen_window times `unit`, or else the centred window of these half extents.
ScreenWindow ReadScreenWindow(const ParamSet& params, float half_width, float half_height,
                              float unit);

// Thin lens: lens_radius [0], focus_distance [1] (scene units; the settings may override both).
void ReadLens(const ParamSet& params, const RenderSettings& settings, RayCamera* camera);

// Reads a camera. Throws kInvalidArgument naming the camera for an unknown type or parameter.
RayCamera CompileCamera(const Camera& camera, const RenderSettings& settings);

// The one that the settings describe (look), or the camera that they name: by name, by index, or ""
// for the first; a fitted one, with a note, if the scene has none. Throws kNotFound listing the
// cameras.
Camera ChooseCamera(const Scene& scene, const Box3f& bounds, const RenderSettings& settings,
                    std::vector<std::string>* notes);

}  // namespace relume::render
