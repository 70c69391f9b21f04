#pragma once

#include <span>

#include "core/math/transform.h"
#include "worker/render/accel/embree.h"
#include "worker/render/accel/triangles.h"
#include "worker/render/bsdf/material.h"

namespace relume::render {

// What the filter of a partly transparent mesh needs.
struct FilterMesh {
    const TriangleData* triangles;  // null: no uvs
    const CompiledMaterial* material;
    const TextureSet* textures;
};

// New, committed geometries; errors, as a lack of memory, stay with the device.

// Of a mesh, with its vertices at each key if it deforms. `filter` must outlive it.
RTCGeometry MakeTriangles(RTCDevice device, const Mesh& mesh, const Transform& to_world,
                          const FilterMesh& filter);
// `to_world`: one, or several at equally spaced times.
RTCGeometry MakeInstance(RTCDevice device, RTCScene shared, std::span<const Transform> to_world);

}  // namespace relume::render
