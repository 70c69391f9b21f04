#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/math/box.h"
#include "core/scene/scene.h"
#include "worker/render/accel/device.h"
#include "worker/render/accel/geometry.h"
#include "worker/render/accel/triangles.h"
#include "worker/render/bsdf/material.h"

// The parts of an Accel that one of the same scene at another time may share. All immutable. Keys
// are digests of all that a part is made of; "" where nobody will ask for it again. Equal keys mean
// equal parts only among scenes with the same materials.
namespace relume::render {

// What is gathered of a mesh.
struct Shape {
    std::string key;
    std::vector<TriangleData> triangles;  // empty where nothing needs them
    std::vector<UvGradients> gradients;   // the same
    FilterMesh filter;                    // points into this object
};

// `used`: some instance shows the mesh; else nothing is gathered.
std::shared_ptr<const Shape> MakeShape(const Mesh& mesh, const CompiledMaterial& material,
                                       const TextureSet& textures, bool used, std::string key);
std::string ShapeKey(const Mesh& mesh);

// Whether shading wants the triangles of each key of the motion.
bool KeepsDataOfKeys(const Mesh& mesh, const CompiledMaterial& material);

// A structure of Embree's, with what its filters point to. Watertight: else about one ray in
// 300 000 slips between two triangles of a fine mesh, and brings the sky into a closed room. Costs
// a seventh of the traversal.
class Structure {
  public:
    explicit Structure(std::shared_ptr<const Device> device);
    ~Structure();
    Structure(const Structure&) = delete;
    Structure& operator=(const Structure&) = delete;

    RTCScene get() const { return scene_; }
    RTCDevice device() const { return device_->get(); }
    // Takes the geometry over; `id` is free. `needs`: is kept as long as the structure is there.
    void Attach(RTCGeometry geometry, std::uint32_t id, std::shared_ptr<const void> needs);
    void Commit() const { rtcCommitScene(scene_); }
    bool empty() const { return needs_.empty(); }

    std::string key;

  private:
    std::shared_ptr<const Device> device_;
    RTCScene scene_;
    std::vector<std::shared_ptr<const void>> needs_;
};

// A mesh in its own space, for instances of it.
struct NestedMesh {
    std::string key;
    Structure structure;
    Box3f bounds;  // at all times

    NestedMesh(std::shared_ptr<const Device> device, const Mesh& mesh,
               const std::shared_ptr<const Shape>& shape);
};

}  // namespace relume::render
