#include "bench/study_scene.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "bench/scene_source.h"

namespace relume::bench {

void AddSceneOptions(CLI::App* app, StudyScene* options) {
    app->add_option("SCENE", options->scene)->required();
    app->add_option("--name", options->name)->required();
    app->add_option("--store", options->store, "folder of the samples")->required();
    app->add_option("--environment", options->environment);
    app->add_option("--environment-scale", options->environment_scale);
    app->add_option("--time", options->time);
    app->add_option("--shutter", options->shutter);
    app->add_option("--size", options->size);
    app->add_option("--look-from", options->look_from)->delimiter(',');
    app->add_option("--look-at", options->look_at)->delimiter(',');
    app->add_option("--fov", options->fov);
    app->add_option("--max-depth", options->depth);
    app->add_option("--threads", options->threads);
    app->add_option("--seeds", options->seeds, "at least 3");
    app->add_option("--stored", options->stored, "samples a pixel that are rendered");
}

std::vector<SampleStore> LoadSamples(const StudyScene& options) {
    RenderSettings settings =
        ViewSettings(options.size, options.look_from, options.look_at, options.fov);
    settings.environment_scale = options.environment_scale;
    std::shared_ptr<const render::BuiltScene> built;
    int depth = options.depth;
    std::vector<SampleStore> stores(static_cast<std::size_t>(options.seeds));
    for (int seed = 0; seed < options.seeds; ++seed) {
        const auto file =
            std::filesystem::path(options.store) /
            fmt::format("{}-{}-{}-{}.samples", options.name, options.size, options.stored, seed);
        SampleStore& store = stores[static_cast<std::size_t>(seed)];
        if (store.Load(file, settings.Window(), options.stored)) {
            continue;
        }
        if (!built) {
            const SceneAndEnvironment files(options.scene, options.environment);
            LoadOptions load;
            load.environment = files.environment_name();
            load.environment_scale = options.environment_scale;
            load.time = options.time;
            load.shutter = options.shutter;
            Scene scene =
                LoadScene(files, std::filesystem::path(options.scene).filename().string(), load);
            depth = depth > 0 ? depth : scene.hints.max_depth > 0 ? scene.hints.max_depth : 8;
            built = std::make_shared<render::BuiltScene>(std::move(scene));
        }
        settings.max_depth = depth;
        settings.seed = static_cast<std::uint32_t>(seed);
        store = SampleStore::Render(render::Renderer(built, settings), settings.Window(),
                                    options.stored, options.threads);
        std::filesystem::create_directories(options.store);
        store.Save(file);
    }
    return stores;
}

}  // namespace relume::bench
