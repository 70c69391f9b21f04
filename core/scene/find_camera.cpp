#include <fmt/format.h>

#include <charconv>

#include "core/base/error.h"
#include "core/scene/scene.h"

namespace relume {

const Camera* FindCamera(const Scene& scene, const std::string& camera) {
    if (camera.empty()) {
        return scene.cameras.empty() ? nullptr : &scene.cameras.front();
    }
    for (const auto& candidate : scene.cameras) {
        if (candidate.name == camera) {
            return &candidate;
        }
    }
    std::size_t index = 0;
    const auto [end, error] = std::from_chars(camera.data(), camera.data() + camera.size(), index);
    if (error == std::errc() && end == camera.data() + camera.size() &&
        index < scene.cameras.size()) {
        return &scene.cameras[index];
    }
    std::string known;
    for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
        known += fmt::format("{}{} '{}'", i > 0 ? ", " : "", i, scene.cameras[i].name);
    }
    ThrowInvalidArgument(
        fmt::format("{}: no camera '{}'; there {}", scene.name, camera,
                    known.empty() ? "is none: leave out --camera" : "are " + known));
}

}  // namespace relume
