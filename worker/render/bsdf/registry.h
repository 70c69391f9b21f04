#pragma once

#include <vector>

#include "core/scene/scene.h"
#include "worker/render/bsdf/material.h"

namespace relume::render {

// Reads a scene's materials. Throws kInvalidArgument naming the material for an unknown type (known
// ones are listed), an unknown or malformed parameter, or a texture that does not exist.
std::vector<CompiledMaterial> CompileMaterials(const Scene& scene);

}  // namespace relume::render
