#pragma once

#include <optional>

#include "core/math/frame.h"
#include "core/math/vec.h"
#include "worker/render/bsdf/albedo_table.h"
#include "worker/render/bsdf/material.h"

namespace relume::render {

// Where a BSDF stands, world space.
struct ShadingFrame {
    Frame frame;        // z: shading normal, on the side of wo
    Vec3f geometric;    // unit normal of the triangle, on the side of wo
    bool front = true;  // wo is on the side from which triangles are counter-clockwise
};

// f (without the cosine) and the density per solid angle with which Sample would have chosen the
// direction.
struct BsdfValue {
    Rgb f;
    float pdf = 0;
};

struct BsdfSample {
    Vec3f wi;       // world, unit length
    Rgb weight;     // f |cos| / pdf
    float pdf = 0;  // per solid angle; 0 marks a perfectly specular direction, which Evaluate knows
                    // nothing of
    float eta2 =
        1;  // square of the relative index crossed: takes radiance scaling out of the roulette
};

// A material at one point, seen from one direction: up to three lobes (diffuse, GGX reflection,
// glass). Radiance is transported: refraction scales it by the square of the relative index.
// Directions on the wrong side of the geometric normal have f = 0. Plain data on the stack; no
// virtual calls.
class Bsdf {
  public:
    Bsdf(const CompiledMaterial& material, const TextureSet& textures, Vec2f uv,
         const ShadingFrame& at, Vec3f wo);

    // Of all lobes that are not perfectly specular.
    BsdfValue Evaluate(Vec3f wi) const;
    // Empty if the path ends. `choice` is used only if NeedsChoice().
    std::optional<BsdfSample> Sample(Vec2f u, float choice) const;

    Rgb Eval(Vec3f wi) const { return Evaluate(wi).f; }
    float Pdf(Vec3f wi) const { return Evaluate(wi).pdf; }

    bool NeedsChoice() const { return glass_probability_ > 0; }
    // False if light can only come from perfectly specular directions (or none): no use to sample
    // lights.
    bool HasSmoothLobe() const { return smooth_; }
    // A mirror or glass to the eye (roughness below 0.1, hardly any diffuse part): features look
    // behind it.
    bool IsNearSpecular() const { return near_specular_; }
    // Reflectance colour for features: does not depend on the directions.
    Rgb albedo() const { return albedo_; }
    Vec3f normal() const { return at_.frame.z; }

  private:
    BsdfValue EvaluateOpaque(Vec3f wi) const;
    BsdfValue EvaluateGlass(Vec3f wi) const;
    BsdfValue EvaluateLocal(Vec3f wi) const;

    enum class Lobe { kDiffuse, kSpecular, kGlass };
    // Chooses by *u and stretches the rest of it back to [0, 1).
    Lobe ChooseLobe(float* u) const;
    // A local direction; weight, if it is perfectly specular; false if it leads nowhere.
    bool SampleSpecular(Vec2f u, Vec3f* wi, BsdfSample* sample) const;
    bool SampleGlass(Vec2f u, float choice, Vec3f* wi, BsdfSample* sample) const;

    ShadingFrame at_;
    Vec3f wo_;  // local, z > 0

    Rgb diffuse_;   // over pi, without the reflection's share at wi
    Rgb multiple_;  // multiple scattering in metals, over pi, without the factor at wi
    Rgb f0_;
    float specular_ = 0;  // weight of the GGX reflection
    float dielectric_f0_ = 0;
    float alpha_ = 1;
    AlbedoRow row_;

    float glass_ = 0;  // weight of the glass
    float eta_ = 1;    // index on the far side over that on the side of wo
    bool thin_ = true;
    Rgb tint_;

    float diffuse_probability_ = 0, specular_probability_ = 0, glass_probability_ = 0;
    bool coupled_ = false;  // the diffuse part lies under a reflecting layer
    bool specular_delta_ = false, glass_delta_ = false;
    bool smooth_ = false, near_specular_ = false;
    Rgb albedo_;
};

}  // namespace relume::render
