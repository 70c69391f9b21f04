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
};

using SceneLoader = std::function<std::shared_ptr<const LoadedScene>(
    const FileSource& files, const SceneManifest& manifest, const RenderSettings& settings)>;

// Loads by core/scene and builds a render::Renderer. Throws Error with file, place and remedy.
SceneLoader MakeSceneLoader();

}  // namespace relume::worker
