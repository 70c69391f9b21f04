#pragma once

#include <vector>

#include "core/scene/scene.h"
#include "worker/render/bsdf/material.h"

namespace relume::render {

// The packs (texture_pack.h) that the materials of `scene` can be read by, each set in
// CompiledMaterial::pack. A picture is packed only if nothing else reads it, so that none is kept
// twice. `used`: one flag a material; parts of a used mix are used.
std::vector<TexturePack> PlanTexturePacks(const Scene& scene, const std::vector<bool>& used,
                                          std::vector<CompiledMaterial>* materials);

}  // namespace relume::render
