#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace relume {

// Where a loader gets a scene's files from: a folder, or blobs by digest on a worker. Names are
// relative to the main file's folder, with forward slashes. Thread-safe.
class FileSource {
  public:
    virtual ~FileSource() = default;
    // Throws kNotFound that names the file and what to do.
    virtual std::string Read(const std::string& name) const = 0;
};

// Files below `folder`; a name that leaves it ("../x", "/x", a link out of it) throws
// kInvalidArgument.
std::unique_ptr<FileSource> MakeFolderSource(const std::string& folder);

// What is kept of a scene's files (not its pictures) to load the scene at other times without
// reading them again. Immutable, thread-safe.
class SceneTimes {
  public:
    virtual ~SceneTimes() = default;
    // As LoadScene with this time and shutter, without the pixels of pictures.
    virtual Scene At(float time, float shutter) const = 0;
};

struct LoadOptions {
    bool decode_images = true;  // false: sizes only are checked (preflight)
    std::string environment;    // name of a latitude-longitude map in the source; "" = none
    float environment_scale = 1;
    // Seconds at which the shutter opens, and for which it is open; negative: as the file says
    // (glTF: 0; pbrt: the camera's shutteropen and shutterclose). Open for 0 s, nothing moves.
    float time = -1, shutter = -1;
    // Bytes that the scene's arrays, without pictures, may take (kResourceExhausted); 0: half of
    // what this process may.
    std::uint64_t most_array_bytes = 0;
    // If set, gets what loads the scene at other times; null where nothing moves, or the format
    // (all but glTF) can't but load it again.
    std::shared_ptr<const SceneTimes>* times = nullptr;
};

// Loads `main_name` by the first format that takes its extension (formats.cpp). Throws Error with
// file, place and remedy on anything that would not render right: missing file, truncated data, NaN
// vertex, empty mesh, index out of range, singular transform.
Scene LoadScene(const FileSource& files, const std::string& main_name, const LoadOptions& options);

// The names of all files that LoadScene reads, main file first, each once, in the file's order.
std::vector<std::string> ListSceneFiles(const FileSource& files, const std::string& main_name);

// Checks what every format must guarantee (see LoadScene); loaders call it last.
void ValidateScene(const Scene& scene);

}  // namespace relume
