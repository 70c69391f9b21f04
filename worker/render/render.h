#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/base/cancel_token.h"
#include "core/film/tile.h"
#include "core/scene/render_settings.h"
#include "core/scene/scene.h"

namespace relume::render {

// What of a scene is the same for every picture of it: Embree structures, textures, materials,
// lights. Immutable, thread-safe.
class BuiltScene {
  public:
    // Builds in parallel (core/base/parallel.h). Throws Error naming material or light if a type
    // or parameter is unknown. Move the scene in: its pictures are then freed one by one as they
    // are converted, and memory never holds them twice. `more_times`: AtAnotherTime will be asked
    // for.
    explicit BuiltScene(Scene scene, bool more_times = false);
    ~BuiltScene();

    // The same scene at another time, loaded without the pixels of its pictures: what both have in
    // common (materials, textures, environment, meshes that keep their shape, structures in which
    // nothing has moved) is shared, and renders the same bits as if built anew. Null if it differs
    // in more than where things are, or has a light with a picture: load it with its pictures and
    // build it.
    std::shared_ptr<const BuiltScene> AtAnotherTime(Scene scene) const;

  private:
    friend class Renderer;
    struct Impl;
    explicit BuiltScene(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

// A scene with camera and settings: cheap to make of one that is built. Immutable, thread-safe.
class Renderer {
  public:
    // Throws Error naming the camera if its type or a parameter is unknown, or if nothing shines
    // (unless settings.allow_black).
    Renderer(std::shared_ptr<const BuiltScene> scene, const RenderSettings& settings);
    // Builds it, too.
    Renderer(const std::shared_ptr<const Scene>& scene, const RenderSettings& settings);
    ~Renderer();

    // Renders a task on the calling thread; any number of threads may call at once. A pure function
    // of (scene, settings, task): the same bits on any machine of the numeric class, and for each
    // pixel whatever the tile. Returns an empty result (no pixels) if cancelled.
    TileResult RenderTile(const TileTask& task, const CancelToken& cancel) const;

    // What the scene needed and what was replaced (a fitted camera), for people.
    const std::vector<std::string>& notes() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

// The instruction set that Embree is held to; part of a worker's numeric class.
inline constexpr const char* kIsa = "avx2";

// Throws kFailedPrecondition if this machine lacks what the renderer was built for.
void CheckCpu();

}  // namespace relume::render
