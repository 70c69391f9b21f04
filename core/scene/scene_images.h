#pragma once

#include <string>
#include <vector>

#include "core/scene/formats.h"

namespace relume {

// One picture that a scene refers to.
struct ImageRequest {
    std::string name;          // in the file source, or "embedded image 3"
    SourceLocation wanted_by;  // for messages
    bool embedded = false;     // the bytes are in the scene's own file:
    std::string bytes;
};

// Reads all pictures, in parallel and each once, in the order of `requests`. The first one that is
// missing or can't be read is an Error that names the file and who wants it; pictures that together
// take more than half of the machine's memory, by their headers, are kResourceExhausted. Without
// LoadOptions::decode_images only headers are looked at.
std::vector<SceneImage> LoadImages(const FileSource& files, std::vector<ImageRequest> requests,
                                   bool decode);

// Makes LoadOptions::environment, if set, the scene's environment: latitude-longitude, linear
// floats, scaled by environment_scale. Replaces what the scene has.
void AddEnvironment(const FileSource& files, const LoadOptions& options, Scene* scene);

}  // namespace relume
