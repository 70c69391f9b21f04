#include "proto/codec/codec.h"
#include "worker/loop/scene_loader.h"

namespace relume::worker {

std::string BuildKey(const SceneManifest& manifest, const RenderSettings& settings) {
    // What is not named here is taken to matter.
    RenderSettings build = settings;
    const RenderSettings same;
    build.width = same.width;
    build.height = same.height;
    build.crop = same.crop;
    build.seed = same.seed;
    build.max_depth = same.max_depth;
    build.camera = same.camera;
    build.look = same.look;
    build.lens_radius = same.lens_radius;
    build.focus_distance = same.focus_distance;
    build.allow_black = same.allow_black;
    return ManifestDigest(manifest) + codec::ToProto(build).SerializeAsString();
}

std::string FrameKey(const SceneManifest& manifest, RenderSettings settings) {
    const RenderSettings same;
    settings.time = same.time;
    settings.shutter = same.shutter;
    return BuildKey(manifest, settings);
}

}  // namespace relume::worker
