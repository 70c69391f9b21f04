#include "worker/loop/scene_loader.h"

#include <utility>

#include "worker/render/render.h"

namespace relume::worker {
namespace {

// What is loaded once for all views of a scene at one time, and what its other times can share.
struct Shared {
    std::vector<std::string> notes;
    std::shared_ptr<const render::BuiltScene> built;
    std::shared_ptr<const SceneTimes> times;  // null: the files are read again
    std::string main;
};

LoadOptions OptionsOf(const RenderSettings& settings) {
    LoadOptions options;
    options.environment = settings.environment;
    options.environment_scale = settings.environment_scale;
    options.time = settings.time;
    options.shutter = settings.shutter;
    return options;
}

std::shared_ptr<const LoadedScene> MakeView(const std::shared_ptr<const Shared>& shared,
                                            const RenderSettings& settings);

// Null if the scenes have too little in common.
std::shared_ptr<const LoadedScene> MakeFrame(const Shared& known, const FileSource& files,
                                             const RenderSettings& settings) {
    auto shared = std::make_shared<Shared>();
    LoadOptions options = OptionsOf(settings);
    options.decode_images = false;
    Scene scene = known.times != nullptr ? known.times->At(settings.time, settings.shutter)
                                         : LoadScene(files, known.main, options);
    shared->notes = scene.notes;
    shared->built = known.built->AtAnotherTime(std::move(scene));
    shared->times = known.times;
    shared->main = known.main;
    return shared->built == nullptr ? nullptr : MakeView(shared, settings);
}

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
    loaded->frame = [shared](const FileSource& files, const RenderSettings& other) {
        return MakeFrame(*shared, files, other);
    };
    return loaded;
}

}  // namespace

SceneLoader MakeSceneLoader() {
    return
        [](const FileSource& files, const SceneManifest& manifest, const RenderSettings& settings) {
            auto shared = std::make_shared<Shared>();
            shared->main = manifest.main;
            LoadOptions options = OptionsOf(settings);
            // Who asks for a time may ask for others.
            const bool more_times = settings.time >= 0;
            options.times = more_times ? &shared->times : nullptr;
            {
                Scene scene = LoadScene(files, manifest.main, options);
                shared->notes = scene.notes;
                shared->built =
                    std::make_shared<const render::BuiltScene>(std::move(scene), more_times);
            }
            return MakeView(shared, settings);
        };
}

}  // namespace relume::worker
