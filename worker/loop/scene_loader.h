#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/cancel_token.h"
#include "core/film/tile.h"
#include "core/scene/formats.h"
#include "core/scene/manifest.h"
#include "core/scene/render_settings.h"

namespace relume::worker {

// A scene ready to render: what the loop needs of a renderer.
struct LoadedScene {
    // Thread-safe; an empty result if cancelled.
    std::function<TileResult(const TileTask&, const CancelToken&)> render;
    std::vector<std::string> notes;  // what was left out or replaced
    // The same scene for a job whose settings differ in nothing that BuildKey tells apart: nothing
    // is loaded or built again. Null: it can't. Throws Error if the settings don't fit the scene.
    std::function<std::shared_ptr<const LoadedScene>(const RenderSettings&)> view;
    // The same scene at another time, for a job whose settings differ in nothing but that and what
    // FrameKey does not tell apart: what does not change is neither loaded nor built again. Null,
    // or answers with null: it can't. `files`: the scene's.
    std::function<std::shared_ptr<const LoadedScene>(const FileSource& files,
                                                     const RenderSettings&)>
        frame;
};

// Scenes with equal keys are equal, but for what pictures of them are made: size, crop, seed,
// depth, camera, lens.
std::string BuildKey(const SceneManifest& manifest, const RenderSettings& settings);
// Scenes with equal keys are equal, but for that and the time.
std::string FrameKey(const SceneManifest& manifest, RenderSettings settings);

using SceneLoader = std::function<std::shared_ptr<const LoadedScene>(
    const FileSource& files, const SceneManifest& manifest, const RenderSettings& settings)>;

// Loads by core/scene and builds a render::Renderer. Throws Error with file, place and remedy.
SceneLoader MakeSceneLoader();

}  // namespace relume::worker
