#pragma once

#include "core/base/param_set.h"
#include "core/scene/scene.h"
#include "worker/render/bsdf/material.h"

namespace relume::render {

// What the makers of materials share when they read parameters.

// A texture index; -1 if the parameter is absent. Throws if the scene has no such texture.
TextureId ReadTexture(const ParamSet& params, const std::string& name, const Scene& scene);

// Three numbers.
Rgb ReadColor(const ParamSet& params, const std::string& name, Rgb otherwise);

// A number in [low, high]; throws with the range.
float ReadInRange(const ParamSet& params, const std::string& name, float otherwise, float low,
                  float high);

// base_color, base_color_texture, base_alpha, emissive, emissive_texture, normal_texture,
// normal_scale, alpha_mode, alpha_cutoff, double_sided: the same for every opaque type.
void ReadSurfaceParams(const ParamSet& params, const Scene& scene, CompiledMaterial* material);

}  // namespace relume::render
