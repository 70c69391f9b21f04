#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/scene/formats.h"
#include "core/scene/manifest.h"
#include "core/scene/render_settings.h"
#include "core/scene/scene.h"

namespace relume::client {

// A scene on this machine: its manifest and where each of its files lies.
struct LocalScene {
    SceneManifest manifest;
    std::map<std::string, std::string> files;  // manifest path to local path
    std::string environment;                   // manifest path of the environment map; "" = none
};

// Lists and hashes the scene file and all that it refers to. `environment` is a path on this
// machine, "" = none; a file outside the scene's folder is entered as "environment/NAME". Throws
// Error that names what is missing.
LocalScene CollectScene(const std::string& scene_path, const std::string& environment);

// The files of a collected scene by manifest path.
std::unique_ptr<FileSource> MakeLocalSource(const LocalScene& scene);

// Loads the scene without its pictures' pixels, so that what is wrong with it shows before anything
// is sent. Of the settings, reads the environment's scale, time and shutter.
Scene LoadForChecks(const LocalScene& scene, const RenderSettings& settings);

// What a job would stumble on, checked on this machine: throws Error if nothing shines (unless
// settings.allow_black) or the camera asked for is not there. Answers with what is worth a note.
std::vector<std::string> CheckScene(const Scene& scene, const RenderSettings& settings);

// Throws naming all that the loader left out or replaced, if there is any.
void RequireNoNotes(const Scene& scene);

// The image's size where the user gives none: 720 lines in the camera's own shape, else 1280x720.
void SetDefaultSize(const Camera* camera, RenderSettings* settings);

}  // namespace relume::client
