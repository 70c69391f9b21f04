#include "worker/loop/scene_loader.h"

#include "worker/render/render.h"

namespace relume::worker {

SceneLoader MakeSceneLoader() {
    return [](const FileSource& files, const SceneManifest& manifest,
              const RenderSettings& settings) {
        LoadOptions options;
        options.environment = settings.environment;
        options.environment_scale = settings.environment_scale;
        auto scene = std::make_shared<const Scene>(LoadScene(files, manifest.main, options));
        auto loaded = std::make_shared<LoadedScene>();
        loaded->notes = scene->notes;
        const auto renderer = std::make_shared<const render::Renderer>(std::move(scene), settings);
        loaded->notes.insert(loaded->notes.end(), renderer->notes().begin(),
                             renderer->notes().end());
        loaded->render = [renderer](const TileTask& task, const CancelToken& cancel) {
            return renderer->RenderTile(task, cancel);
        };
        return std::shared_ptr<const LoadedScene>(std::move(loaded));
    };
}

}  // namespace relume::worker
