#include "worker/render/look.h"

#include <algorithm>

#include "worker/render/bsdf/registry.h"
#include "worker/render/bsdf/texture_packs.h"

namespace relume::render {
namespace {

// Materials of meshes that are there, and the parts of those that are mixes.
std::vector<bool> UsedMaterials(const Scene& scene,
                                const std::vector<CompiledMaterial>& materials) {
    std::vector<bool> used(materials.size(), false);
    const auto mark = [&](int material, const auto& again) -> void {
        const auto i = static_cast<std::size_t>(material);
        if (!used[i]) {
            used[i] = true;
            if (materials[i].model == Model::kMix) {
                again(materials[i].mix_a, again);
                again(materials[i].mix_b, again);
            }
        }
    };
    for (const Instance& instance : scene.instances) {
        mark(scene.meshes[static_cast<std::size_t>(instance.mesh)].material, mark);
    }
    return used;
}

TextureSet MakeTextures(Scene* scene, std::vector<CompiledMaterial>* materials) {
    const std::vector<bool> used = UsedMaterials(*scene, *materials);
    std::vector<bool> read(scene->textures.size(), false);
    for (std::size_t i = 0; i < used.size(); ++i) {
        for (const TextureId id : (*materials)[i].Textures()) {
            if (used[i] && id >= 0) {
                read[static_cast<std::size_t>(id)] = true;
            }
        }
    }
    return TextureSet(scene, read, PlanTexturePacks(*scene, used, materials));
}

bool SameMaterial(const Material& a, const Material& b) {
    return a.type == b.type && a.params.values() == b.params.values();
}

bool SameImage(const SceneImage& a, const SceneImage& b) {
    return a.name == b.name && a.width == b.width && a.height == b.height;
}

bool SameEnvironment(const std::optional<Environment>& a, const std::optional<Environment>& b) {
    return a.has_value() == b.has_value() &&
           (!a || (a->image == b->image && a->color == b->color && a->to_world == b->to_world));
}

}  // namespace

Look::Source Look::Describe(const Scene& scene) {
    Source source;
    source.name = scene.name;
    source.materials = scene.materials;
    source.textures = scene.textures;
    for (const SceneImage& image : scene.images) {
        SceneImage& kept = source.images.emplace_back();
        kept.name = image.name;
        kept.width = image.width;
        kept.height = image.height;
    }
    if (scene.environment != nullptr) {
        source.environment = *scene.environment;
    }
    source.used.resize(scene.materials.size(), false);
    for (const Instance& instance : scene.instances) {
        const int material = scene.meshes[static_cast<std::size_t>(instance.mesh)].material;
        source.used[static_cast<std::size_t>(material)] = true;
    }
    return source;
}

Look::Look(Scene* scene)
    : source_(Describe(*scene)),
      materials_(CompileMaterials(*scene)),
      textures_(MakeTextures(scene, &materials_)),
      environment_(std::make_shared<const EnvironmentLight>(*scene)) {}

bool Look::Fits(const Scene& scene) const {
    const Source other = Describe(scene);
    // Such a light reads its picture's pixels itself.
    const bool has_light_maps =
        std::any_of(scene.lights.begin(), scene.lights.end(),
                    [](const Light& light) { return light.params.Has("image"); });
    return !has_light_maps && other.name == source_.name && other.used == source_.used &&
           other.textures == source_.textures &&
           std::ranges::equal(other.materials, source_.materials, SameMaterial) &&
           std::ranges::equal(other.images, source_.images, SameImage) &&
           SameEnvironment(other.environment, source_.environment);
}

}  // namespace relume::render
