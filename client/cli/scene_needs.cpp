#include "client/cli/scene_needs.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <set>

namespace relume::client {
namespace {

bool Emits(const Material& material) {
    for (const float value : material.params.GetFloats("emissive", {0, 0, 0})) {
        if (value > 0) {
            return true;
        }
    }
    return false;
}

const struct {
    const char* what;
    std::function<bool(const Material&)> needed;
} kMaterialNeeds[] = {
    {"textures",
     [](const Material& m) {
         for (const auto& [name, value] : m.params.values()) {
             if (name.ends_with("_texture")) {
                 return true;
             }
         }
         return false;
     }},
    {"normal maps",
     [](const Material& m) {
         return m.params.Has("normal_texture") || m.params.Has("clearcoat_normal_texture");
     }},
    {"bump maps", [](const Material& m) { return m.params.Has("bump_texture"); }},
    {"cut-outs (alpha mask)",
     [](const Material& m) { return m.params.GetString("alpha_mode", "opaque") == "mask"; }},
    {"transparency (alpha blend)",
     [](const Material& m) { return m.params.GetString("alpha_mode", "opaque") == "blend"; }},
    {"transmission",
     [](const Material& m) {
         return m.type == "dielectric" || m.type == "thin_dielectric" ||
                m.type == "diffuse_transmission" || m.params.GetFloat("transmission", 0) > 0;
     }},
    {"absorption in glass", [](const Material& m) { return m.params.Has("absorption"); }},
    {"coats",
     [](const Material& m) {
         return m.type.starts_with("coated_") || m.params.GetFloat("clearcoat", 0) > 0;
     }},
    {"sheen", [](const Material& m) { return m.params.Has("sheen_color"); }},
    {"mixed materials", [](const Material& m) { return m.type == "mix"; }},
    {"area lights", Emits},
};

// What moves while the shutter is open, and at how many keys; "" if nothing does.
std::string MotionNeeds(const Scene& scene) {
    std::size_t instances = 0, meshes = 0, cameras = 0, keys = 0;
    for (const auto& instance : scene.instances) {
        const auto& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
        instances += instance.motion.empty() ? 0 : 1;
        meshes += mesh.motion.empty() ? 0 : 1;
        keys = std::max({keys, instance.motion.size(), mesh.motion.size()});
    }
    for (const auto& camera : scene.cameras) {
        cameras += camera.motion.empty() ? 0 : 1;
        keys = std::max(keys, camera.motion.size());
    }
    std::vector<std::string> parts;
    const auto add = [&](std::size_t count, const char* what) {
        if (count > 0) {
            parts.push_back(fmt::format("{} {}{}", count, what, count == 1 ? "" : "s"));
        }
    };
    add(instances, "moving instance");
    add(meshes, "deforming mesh");
    add(cameras, "moving camera");
    return parts.empty()
               ? std::string()
               : fmt::format("motion blur ({}; up to {} keys)", fmt::join(parts, ", "), keys);
}

}  // namespace

std::vector<std::string> SceneNeeds(const Scene& scene) {
    std::set<int> meshes, materials;
    for (const auto& instance : scene.instances) {
        meshes.insert(instance.mesh);
        materials.insert(scene.meshes[static_cast<std::size_t>(instance.mesh)].material);
    }
    std::vector<std::string> needs;
    if (scene.instances.size() > meshes.size()) {
        needs.push_back(
            fmt::format("instances ({}, of {} meshes)", scene.instances.size(), meshes.size()));
    }
    for (const auto& [what, needed] : kMaterialNeeds) {
        int count = 0;
        for (const int material : materials) {
            count += needed(scene.materials[static_cast<std::size_t>(material)]) ? 1 : 0;
        }
        if (count > 0) {
            needs.push_back(fmt::format("{} ({} material{})", what, count, count == 1 ? "" : "s"));
        }
    }
    if (!scene.lights.empty()) {
        needs.push_back(fmt::format("delta lights ({})", scene.lights.size()));
    }
    if (scene.environment) {
        needs.push_back(scene.environment->image >= 0 ? "environment map" : "constant environment");
    }
    if (const std::string motion = MotionNeeds(scene); !motion.empty()) {
        needs.push_back(motion);
    }
    for (const auto& camera : scene.cameras) {
        if (camera.params.GetFloat("lens_radius", 0) > 0) {
            needs.push_back("lens");
            break;
        }
    }
    return needs;
}

}  // namespace relume::client
