#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "worker/render/bsdf/material.h"
#include "worker/render/light/environment_light.h"
#include "worker/render/texture/texture_set.h"

namespace relume::render {

// What of a scene does not depend on the time: materials, textures, environment. Immutable,
// thread-safe.
class Look {
  public:
    // Takes the pictures out of the scene one by one as they are converted.
    explicit Look(Scene* scene);
    Look(const Look&) = delete;
    Look& operator=(const Look&) = delete;

    // True if the look of `scene`, whose pictures need no pixels, is this one: it is the same scene
    // at another time.
    bool Fits(const Scene& scene) const;

    const std::vector<CompiledMaterial>& materials() const { return materials_; }
    const TextureSet& textures() const { return textures_; }
    const std::shared_ptr<const EnvironmentLight>& environment() const { return environment_; }

  private:
    // What it was made of, without pixels.
    struct Source {
        std::string name;
        std::vector<Material> materials;
        std::vector<Texture> textures;
        std::vector<SceneImage> images;
        std::optional<Environment> environment;
        std::vector<bool> used;  // by material
    };
    static Source Describe(const Scene& scene);

    const Source source_;
    std::vector<CompiledMaterial> materials_;
    TextureSet textures_;
    std::shared_ptr<const EnvironmentLight> environment_;
};

}  // namespace relume::render
