#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/scene/formats.h"
#include "core/scene/render_settings.h"

namespace relume::bench {

// A scene's folder, and an environment map from anywhere ("": none).
class SceneAndEnvironment final : public FileSource {
  public:
    SceneAndEnvironment(const std::string& scene, const std::string& environment)
        : folder_(MakeFolderSource(std::filesystem::absolute(scene).parent_path().string())),
          environment_(environment) {}

    std::string environment_name() const {
        return environment_.empty()
                   ? std::string()
                   : "environment/" + std::filesystem::path(environment_).filename().string();
    }
    std::string Read(const std::string& name) const override {
        return name == environment_name() && !name.empty() ? ReadFile(environment_)
                                                           : folder_->Read(name);
    }

  private:
    std::unique_ptr<FileSource> folder_;
    std::string environment_;
};

// Settings for a frame of `size` ("640x360"), seen from `look_from` if that has three numbers, else
// by the scene's own camera.
inline RenderSettings ViewSettings(const std::string& size, const std::vector<float>& look_from,
                                   const std::vector<float>& look_at, float fov) {
    RenderSettings settings;
    if (std::sscanf(size.c_str(), "%dx%d", &settings.width, &settings.height) != 2) {
        ThrowInvalidArgument("--size " + size + ": must look like 640x360");
    }
    if (!look_from.empty()) {
        const auto vector = [](const std::vector<float>& v) { return Vec3f{v[0], v[1], v[2]}; };
        settings.look.emplace();
        settings.look->from = vector(look_from);
        settings.look->at = vector(look_at);
        settings.look->fov = fov;
    }
    return settings;
}

}  // namespace relume::bench
