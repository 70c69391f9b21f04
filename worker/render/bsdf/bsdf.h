#pragma once

#include <optional>
#include <variant>

#include "core/math/frame.h"
#include "core/math/vec.h"
#include "worker/render/bsdf/coated.h"
#include "worker/render/bsdf/conductor.h"
#include "worker/render/bsdf/dielectric.h"
#include "worker/render/bsdf/diffuse.h"
#include "worker/render/bsdf/layered.h"
#include "worker/render/bsdf/material.h"
#include "worker/render/bsdf/metallic_roughness.h"

namespace relume::render {

// Where a BSDF stands, world space.
struct ShadingFrame {
    Frame frame;          // z: shading normal, on the side of wo; x: along u, where that matters
    Vec3f geometric;      // unit normal of the triangle, on the side of wo
    Vec3f coat{0, 0, 0};  // normal of a clear coat, on the side of wo; 0: the shading normal
    bool front = true;    // wo is on the side from which triangles are counter-clockwise
};

struct BsdfSample {
    Vec3f wi;       // world, unit length
    Rgb weight;     // f |cos| / pdf
    float pdf = 0;  // per solid angle; 0 marks a perfectly specular direction, which Evaluate knows
                    // nothing of
    float eta2 =
        1;  // square of the relative index crossed: takes radiance scaling out of the roulette
    bool transmitted = false;  // to the other side
};

// A material at one point, seen from one direction. Radiance is transported: refraction scales it
// by the square of the relative index. Directions on the wrong side of the geometric normal have
// f = 0. Plain data on the stack; no virtual calls: a switch on the model (lobe.h).
class Bsdf {
  public:
    // `material` is no mix (see ResolveMix). `texels`: those of its pack; null if it has none.
    Bsdf(const CompiledMaterial& material, const TextureSet& textures, Vec2f uv,
         const ShadingFrame& at, Vec3f wo, const SurfaceTexels* texels = nullptr);

    // Of all lobes that are not perfectly specular.
    BsdfValue Evaluate(Vec3f wi) const;
    // Empty if the path ends. `choice` is used only if NeedsChoice().
    std::optional<BsdfSample> Sample(Vec2f u, float choice) const;

    Rgb Eval(Vec3f wi) const { return Evaluate(wi).f; }
    float Pdf(Vec3f wi) const { return Evaluate(wi).pdf; }

    bool NeedsChoice() const { return traits_.needs_choice; }
    // False if light can only come from perfectly specular directions (or none): no use to sample
    // lights.
    bool HasSmoothLobe() const { return traits_.smooth; }
    // A mirror or glass to the eye (roughness below 0.1, hardly any diffuse part): features look
    // behind it.
    bool IsNearSpecular() const { return traits_.near_specular; }
    // Reflectance colour for features: does not depend on the directions.
    Rgb albedo() const { return traits_.albedo; }
    Vec3f normal() const { return at_.frame.z; }

  private:
    ShadingFrame at_;
    LobeTraits traits_;
    std::variant<std::monostate, DiffuseModel, MetallicRoughnessModel, LayeredModel, ConductorModel,
                 CoatedDiffuseModel, CoatedConductorModel, DielectricModel, ThinDielectricModel,
                 DiffuseTransmissionModel>
        model_;
};

// The part of a mix that scatters, chosen by the 32 uniform bits of `choice`; any other material
// itself.
const CompiledMaterial& ResolveMix(const CompiledMaterial& material,
                                   const std::vector<CompiledMaterial>& materials,
                                   const TextureSet& textures, Vec2f uv, std::uint32_t choice);

}  // namespace relume::render
