#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/base/files.h"
#include "core/scene/formats.h"

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

}  // namespace relume::bench
