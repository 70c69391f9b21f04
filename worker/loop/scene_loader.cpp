#include "worker/loop/scene_loader.h"

#include <utility>

#include "worker/render/render.h"

namespace relume::worker {
namespace {

// A view of what is loaded once: scene notes and structures.
struct Shared {
    std::vector<std::string> notes;
    std::shared_ptr<const render::BuiltScene> built;
};

std::shared_ptr<const LoadedScene> MakeView(const std::shared_ptr<const Shared>& shared,
                                            const RenderSettings& settings) {
    auto loaded = std::make_shared<LoadedScene>();
    const auto renderer = std::make_shared<const render::Renderer>(shared->built, settings);
    loaded->notes = shared->notes;
    loaded->notes.insert(loaded->notes.end(), renderer->notes().begin(), renderer->notes().end());
    loaded->render = [renderer](const TileTask& task, const CancelToken& cancel) {
        return renderer->RenderTile(task, cancel);
    };
    loaded->view = [shared](const RenderSettings& other) { return MakeView(shared, other); };
    return loaded;
}

}  // namespace

SceneLoader MakeSceneLoader() {
    return
        [](const FileSource& files, const SceneManifest& manifest, const RenderSettings& settings) {
            LoadOptions options;
            options.environment = settings.environment;
            options.environment_scale = settings.environment_scale;
            options.time = settings.time;
            options.shutter = settings.shutter;
            auto shared = std::make_shared<Shared>();
            {
                Scene scene = LoadScene(files, manifest.main, options);
                shared->notes = scene.notes;
                shared->built = std::make_shared<const render::BuiltScene>(std::move(scene));
            }
            return MakeView(shared, settings);
        };
}

}  // namespace relume::worker
