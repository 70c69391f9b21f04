#include "worker/render/accel/shapes.h"

#include <utility>

#include "core/base/sha256.h"

namespace relume::render {
namespace {

bool NeedsTriangleData(const Mesh& mesh, const CompiledMaterial& material) {
    return !mesh.normals.empty() || (!mesh.uvs.empty() && material.NeedsUv());
}

template <class T>
void Add(const std::vector<T>& values, Sha256* sha) {
    const std::uint64_t count = values.size();
    sha->Update(&count, sizeof(count));
    sha->Update(values.data(), values.size() * sizeof(T));
}

}  // namespace

bool KeepsDataOfKeys(const Mesh& mesh, const CompiledMaterial& material) {
    return !mesh.motion.empty() && NeedsTriangleData(mesh, material) &&
           (!mesh.normals.empty() || material.needs_tangents);
}

std::string ShapeKey(const Mesh& mesh) {
    Sha256 sha;
    sha.Update(&mesh.material, sizeof(mesh.material));
    Add(mesh.positions, &sha);
    Add(mesh.normals, &sha);
    Add(mesh.uvs, &sha);
    Add(mesh.tangents, &sha);
    Add(mesh.tangent_signs, &sha);
    Add(mesh.triangles, &sha);
    for (const auto& positions : mesh.motion) {
        Add(positions, &sha);
    }
    return sha.HexDigest();
}

std::shared_ptr<const Shape> MakeShape(const Mesh& mesh, const CompiledMaterial& material,
                                       const TextureSet& textures, bool used, std::string key) {
    auto shape = std::make_shared<Shape>();
    shape->key = std::move(key);
    if (used && NeedsTriangleData(mesh, material)) {
        shape->triangles = KeepsDataOfKeys(mesh, material)
                               ? GatherMovingTriangles(mesh, material.needs_tangents)
                               : GatherTriangles(mesh, material.needs_tangents);
    }
    if (used && material.bump_texture >= 0 && !mesh.uvs.empty()) {
        shape->gradients = GatherUvGradients(mesh);
    }
    const bool has_uvs = !mesh.uvs.empty() && !shape->triangles.empty();
    shape->filter = {has_uvs ? shape->triangles.data() : nullptr, &material, &textures};
    return shape;
}

Structure::Structure(std::shared_ptr<const Device> device)
    : device_(std::move(device)), scene_(rtcNewScene(device_->get())) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
}

Structure::~Structure() { rtcReleaseScene(scene_); }

void Structure::Attach(RTCGeometry geometry, std::uint32_t id, std::shared_ptr<const void> needs) {
    rtcAttachGeometryByID(scene_, geometry, id);
    rtcReleaseGeometry(geometry);
    needs_.push_back(std::move(needs));
}

NestedMesh::NestedMesh(std::shared_ptr<const Device> device, const Mesh& mesh,
                       const std::shared_ptr<const Shape>& shape)
    : key(shape->key), structure(std::move(device)) {
    structure.Attach(MakeTriangles(structure.device(), mesh, Transform(), shape->filter), 0, shape);
    structure.Commit();
    for (const Vec3f p : mesh.positions) {
        bounds.Add(p);
    }
    for (const std::vector<Vec3f>& positions : mesh.motion) {
        for (const Vec3f p : positions) {
            bounds.Add(p);
        }
    }
}

}  // namespace relume::render
