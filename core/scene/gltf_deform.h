#pragma once

#include <map>
#include <vector>

#include "core/scene/gltf_animation.h"

namespace relume::gltf {

// Meshes whose vertices move against each other: morph targets (section 3.7.2.2), then skins
// (3.7.3). Not thread-safe.
class Deformer {
  public:
    Deformer(const Document& document, const Data& data, const Poses& poses, const Placed& placed)
        : document_(document), data_(data), poses_(poses), placed_(placed) {}

    // Whether the mesh is not as it was modelled, or not the same as where else it is used.
    bool Deforms(const Placed::MeshUse& use) const;
    // Gives a mesh, as its primitive has it, the shape that it has in this use: positions, normals
    // and tangents at the shutter's opening, and Mesh::motion if it changes. A skin puts it in
    // world space.
    void Deform(const tinygltf::Primitive& primitive, const Placed::MeshUse& use, Mesh* mesh);

  private:
    struct Skin {
        std::vector<SampledTransform> joints;  // from the mesh as modelled to the world
        std::size_t keys = 1;                  // that these need
    };
    const Skin& SkinOf(const Placed::MeshUse& use);
    SampledWeights WeightsOf(const Placed::MeshUse& use) const;

    const Document& document_;
    const Data& data_;
    const Poses& poses_;
    const Placed& placed_;
    std::map<int, Skin> skins_;
};

}  // namespace relume::gltf
