#pragma once

#include <memory>
#include <vector>

#include "worker/render/bsdf/registry.h"
#include "worker/render/light/light_set.h"

namespace relume::test {

// A scene made ready as far as lights need it.
struct Lit {
    std::vector<render::CompiledMaterial> materials;
    render::TextureSet textures;
    render::Accel accel;
    render::LightSet lights;

    explicit Lit(Scene scene)
        : materials(render::CompileMaterials(scene)),
          textures(&scene, std::vector<bool>(scene.textures.size(), true), {}),
          accel(scene, materials, textures),
          lights(scene, materials, textures,
                 std::make_shared<const render::EnvironmentLight>(scene), &accel) {}
};

}  // namespace relume::test
