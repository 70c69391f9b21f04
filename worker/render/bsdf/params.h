#pragma once

#include <string>
#include <vector>

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

// What every type has: emissive, emissive_texture, normal_texture, normal_scale, bump_texture,
// bump_scale, alpha, alpha_texture, alpha_mode, alpha_cutoff, double_sided.
void ReadSurfaceParams(const ParamSet& params, const Scene& scene, CompiledMaterial* material);
// base_color, base_color_texture, base_alpha.
void ReadBaseColor(const ParamSet& params, const Scene& scene, CompiledMaterial* material);
// alpha_u, alpha_v and their textures.
void ReadAlphas(const ParamSet& params, float otherwise, const Scene& scene,
                CompiledMaterial* material);
void ReadAbsorption(const ParamSet& params, CompiledMaterial* material);

// After all materials are read: what a mix takes over from its parts, and which geometry each
// needs. Throws if a mix names what isn't there, or itself.
void FinishMaterials(const Scene& scene, std::vector<CompiledMaterial>* materials);

}  // namespace relume::render
