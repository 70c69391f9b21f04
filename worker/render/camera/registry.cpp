#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "core/base/error.h"
#include "worker/render/camera/ray_camera.h"

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
    const std::string owner =
        camera.source.empty() ? fmt::format("camera '{}'", camera.name) : camera.source;
    std::string known;
    for (const Entry& entry : kCameras) {
        if (camera.type == entry.type) {
            try {
                const ParamSet params = camera.params;  // reading marks: scenes are shared
                RayCamera compiled = entry.make(params, settings);
                params.RejectUnused(fmt::format("camera type '{}'", camera.type));
                compiled.width = settings.width;
                compiled.height = settings.height;
                compiled.origin = camera.to_world.Point({0, 0, 0});
                compiled.right = Normalize(camera.to_world.Vector({1, 0, 0}));
                compiled.up = Normalize(camera.to_world.Vector({0, 1, 0}));
                compiled.forward = Normalize(camera.to_world.Vector({0, 0, -1}));
                if (!IsFinite(compiled.origin) || !IsFinite(compiled.right) ||
                    !IsFinite(compiled.up) || !IsFinite(compiled.forward)) {
                    ThrowInvalidArgument("its transform is not finite or has a scale of 0");
                }
                return compiled;
            } catch (const Error& error) {
                throw Error(error.code(), fmt::format("{}: {}", owner, error.what()));
            }
        }
        known += fmt::format("{}{}", known.empty() ? "" : ", ", entry.type);
    }
    ThrowInvalidArgument(
        fmt::format("{}: unknown camera type '{}'; known are {}", owner, camera.type, known));
}

Camera ChooseCamera(const Scene& scene, const RenderSettings& settings,
                    std::vector<std::string>* notes) {
    const std::string& wanted = settings.camera;
    if (wanted.empty() && scene.cameras.empty()) {
        notes->push_back("the scene has no camera: one that sees all of it was fitted");
        return FitCamera(scene,
                         static_cast<float>(settings.width) / static_cast<float>(settings.height));
    }
    if (wanted.empty()) {
        return scene.cameras.front();
    }
    std::string list;
    for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
        if (scene.cameras[i].name == wanted) {
            return scene.cameras[i];
        }
        list += fmt::format("{}{} '{}'", i == 0 ? "" : ", ", i, scene.cameras[i].name);
    }
    std::size_t index = 0;
    const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), index);
    if (error == std::errc() && end == wanted.data() + wanted.size() &&
        index < scene.cameras.size()) {
        return scene.cameras[index];
    }
    ThrowNotFound(
        fmt::format("there is no camera '{}'; the scene has {}", wanted,
                    list.empty() ? "none: leave the camera out, and one is fitted" : list));
}

}  // namespace relume::render
