#include "core/scene/scene.h"

#include <algorithm>

namespace relume {
namespace {

bool IsBright(const Rgb& color) { return MaxComponent(color) > 0; }

// Looks without ParamSet's getters: those would mark the parameter as read by its material.
bool IsEmissive(const Material& material) {
    const auto it = material.params.values().find("emissive");
    if (it == material.params.values().end()) {
        return false;
    }
    const auto* color = std::get_if<std::vector<float>>(&it->second);
    return color != nullptr &&
           std::any_of(color->begin(), color->end(), [](float c) { return c > 0; });
}

}  // namespace

Box3f Scene::Bounds() const {
    Box3f box;
    for (const Instance& instance : instances) {
        const Mesh& mesh = meshes[static_cast<std::size_t>(instance.mesh)];
        const auto add = [&](const std::vector<Vec3f>& positions) {
            for (const Vec3f& p : positions) {
                box.Add(instance.to_world.Point(p));
            }
            // Between keys points go straight ahead.
            for (const Transform& to_world : instance.motion) {
                for (const Vec3f& p : positions) {
                    box.Add(to_world.Point(p));
                }
            }
        };
        add(mesh.positions);
        for (const std::vector<Vec3f>& positions : mesh.motion) {
            add(positions);
        }
    }
    return box;
}

std::uint64_t Scene::TriangleCount() const {
    std::uint64_t count = 0;
    for (const Instance& instance : instances) {
        count += meshes[static_cast<std::size_t>(instance.mesh)].triangles.size();
    }
    return count;
}

bool Scene::HasLight() const {
    if (environment != nullptr && IsBright(environment->color)) {
        return true;
    }
    if (!lights.empty()) {
        return true;
    }
    return std::any_of(instances.begin(), instances.end(), [this](const Instance& instance) {
        const Mesh& mesh = meshes[static_cast<std::size_t>(instance.mesh)];
        return IsEmissive(materials[static_cast<std::size_t>(mesh.material)]);
    });
}

}  // namespace relume
