#pragma once

#include <string>

#include "core/image/image.h"
#include "core/scene/render_settings.h"

namespace relume::client {

// What an image of Relume's says in its metadata of how its samples came about.
struct ImageOrigin {
    RenderSettings settings;   // its seed among them
    std::string scene_sha256;  // digest of the scene's manifest
    std::string filter, build;
};

// Throws kInvalidArgument if the image does not say it, or if its settings make no sense or are not
// those of its window.
ImageOrigin ReadOrigin(const Image& image);

// The environment map that is to be collected with the scene: `given` by the user, else the one of
// the settings where it lies in the scene's folder; "" if the image has none of the job's own.
// Throws kInvalidArgument that asks for it if it came from elsewhere, or if there was none.
std::string FindEnvironment(const ImageOrigin& origin, const std::string& scene_path,
                            const std::string& given);

}  // namespace relume::client
