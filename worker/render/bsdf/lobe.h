#pragma once

#include <algorithm>
#include <cmath>

#include "core/math/vec.h"
#include "worker/render/bsdf/material.h"

namespace relume::render {

// What the models of scattering share. A model is a struct of plain data made for one hit point and
// one direction `wo` that has
//   BsdfValue Evaluate(Vec3f wi) const;        of all lobes that are not perfectly specular
//   bool Sample(Vec2f u, float choice, LobeSample* sample) const;    false: the path ends
// Directions are local (z: the shading normal, on the side of wo, wo.z > 0) and point away from the
// surface. Bsdf (bsdf.h) holds one of them and adds what holds for all.

// f (without the cosine) and the density per solid angle with which Sample would have chosen the
// direction.
struct BsdfValue {
    Rgb f;
    float pdf = 0;
};

struct LobeSample {
    Vec3f wi;            // unit length
    bool delta = false;  // perfectly specular: `weight` counts, and Evaluate knows nothing of it
    float pdf = 0;       // above 0: `weight` counts too, else both are Evaluate's
    Rgb weight;          // f |cos| / pdf
    float eta2 = 1;      // square of the relative index crossed
};

// Where a model is made.
struct LobeSite {
    const CompiledMaterial& material;
    const TextureSet& textures;
    Vec2f uv;
    Vec3f wo;
    bool front = true;  // wo is on the side from which triangles are counter-clockwise
    const SurfaceTexels* texels = nullptr;  // of the material's pack, if it has one

    Rgb Color(Rgb value, TextureId texture) const { return Textured(value, texture, textures, uv); }
    float Number(float value, TextureId texture) const {
        return Textured(value, texture, textures, uv);
    }
};

// What the path tracer asks of any model.
struct LobeTraits {
    Rgb albedo;                  // see Bsdf::albedo
    bool smooth = false;         // some lobe is not perfectly specular
    bool near_specular = false;  // see Bsdf::IsNearSpecular
    bool needs_choice = false;   // Sample reads `choice`
};

// Sharper reflections are mirrors to the eye.
inline constexpr float kNearSpecularAlpha = 0.01f;

inline constexpr float kBelowOne = 0x1.fffffep-1f;

// True with probability p; *u is stretched back to [0, 1).
inline bool Choose(float p, float* u) {
    if (*u < p) {
        *u = std::min(*u / p, kBelowOne);
        return true;
    }
    *u = std::min((*u - p) / (1 - p), kBelowOne);
    return false;
}

}  // namespace relume::render
