#pragma once

#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace relume::client {

// What of the renderer a scene makes use of, a line each: "normal maps (3 materials)". Only what
// instances show counts.
std::vector<std::string> SceneNeeds(const Scene& scene);

}  // namespace relume::client
