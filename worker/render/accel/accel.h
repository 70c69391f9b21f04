#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "worker/render/accel/triangles.h"
#include "worker/render/bsdf/material.h"

struct RTCSceneTy;  // Embree's

namespace relume::render {

struct Ray {
    Vec3f origin;
    float far = std::numeric_limits<float>::infinity();  // in lengths of the direction
    Vec3f direction;
    std::uint32_t seed = 0;  // decides at partly transparent surfaces
    float time = 0;          // in [0, 1]: 0 is when the shutter opens
};

struct Hit {
    float t = 0, u = 0, v = 0;
    std::uint32_t object = 0, triangle = 0;
    float time = 0;  // of the ray
    Vec3f normal;    // of the triangle's front, world space, unit length
};

// The scene's triangles behind Embree. Immutable, thread-safe. Meshes of one instance lie in one
// structure, in world space; meshes of several share one (two levels), unless that costs little
// memory to avoid. What moves has two levels; a mesh that deforms has its vertices at each key.
class Accel {
  public:
    enum class Reuse { kNever, kLater };  // kLater: may be `before` of another one

    // Keeps references to `materials` (one a material of the scene) and `textures`, not to `scene`.
    // `before`: of the scene at another time, with the same materials and textures: what is the
    // same in both is not built again. The structures are those that would be built without it.
    Accel(const Scene& scene, const std::vector<CompiledMaterial>& materials,
          const TextureSet& textures, Reuse reuse = Reuse::kNever, const Accel* before = nullptr);
    ~Accel();
    Accel(const Accel&) = delete;
    Accel& operator=(const Accel&) = delete;

    // The nearest surface that stops the ray.
    bool Intersect(const Ray& ray, Hit* hit) const;
    bool Occluded(const Ray& ray) const;

    // One for each instance of the scene, in its order.
    std::vector<Object>& objects() { return objects_; }
    const std::vector<Object>& objects() const { return objects_; }
    std::string Describe() const;
    // Whether anything is elsewhere at another time.
    bool moves() const { return !motions_.empty(); }

  private:
    struct Embree;
    std::vector<Object> objects_;
    std::deque<ObjectMotion> motions_;
    std::unique_ptr<Embree> embree_;
    RTCSceneTy *flat_ = nullptr, *nested_ = nullptr;  // of embree_; null: nothing is there
};

// Throws kFailedPrecondition if Embree can't be held to `kIsa`.
void CheckEmbree();

}  // namespace relume::render
