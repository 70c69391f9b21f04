#include <cmath>

#include "worker/render/accel/triangles.h"

namespace relume::render {
namespace {

// Of the triangles around each vertex, weighted by area; not normalised.
std::vector<Vec3f> NormalsAround(const Mesh& mesh, const std::vector<Vec3f>& positions) {
    std::vector<Vec3f> normals(positions.size());
    for (const Vec3u& t : mesh.triangles) {
        const Vec3f area = Cross(positions[t.y] - positions[t.x], positions[t.z] - positions[t.x]);
        for (const std::uint32_t corner : {t.x, t.y, t.z}) {
            normals[corner] += area;
        }
    }
    return normals;
}

// The least rotation that takes the direction of `from` to that of `to`, applied to v (Rodrigues).
Vec3f Turn(Vec3f v, Vec3f from, Vec3f to) {
    const float lengths = std::sqrt(Length2(from)) * std::sqrt(Length2(to));
    if (!(lengths > 0)) {
        return v;
    }
    const float cosine = Dot(from, to) / lengths;
    if (cosine <= -0.999f) {
        return -v;
    }
    const Vec3f axis = Cross(from, to) / lengths;
    return v * cosine + Cross(axis, v) + axis * (Dot(axis, v) / (1 + cosine));
}

}  // namespace

std::vector<TriangleData> GatherMovingTriangles(const Mesh& mesh, bool tangents) {
    Mesh posed = mesh;
    posed.motion.clear();
    const std::vector<Vec3f> before = NormalsAround(mesh, mesh.positions);
    std::vector<TriangleData> all;
    all.reserve(mesh.motion.size() * mesh.triangles.size());
    for (const std::vector<Vec3f>& positions : mesh.motion) {
        posed.positions = positions;
        const std::vector<Vec3f> now = NormalsAround(mesh, positions);
        for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
            posed.normals[i] = Turn(mesh.normals[i], before[i], now[i]);
        }
        for (std::size_t i = 0; i < mesh.tangents.size(); ++i) {
            posed.tangents[i] = Turn(mesh.tangents[i], before[i], now[i]);
        }
        const std::vector<TriangleData> key = GatherTriangles(posed, tangents);
        all.insert(all.end(), key.begin(), key.end());
    }
    return all;
}

const Object& Object::MoveTo(float time, std::optional<Object>* moved) const {
    Object& object = moved->emplace(*this);
    if (!motion->to_world.empty()) {
        object.SetTransform(Interpolate(motion->to_world, time));
    }
    if (motion->shapes > 0) {
        const KeyTime at(time, motion->shapes);
        object.triangles = triangles + at.key * motion->triangles;
        object.next_triangles = object.triangles + motion->triangles;
        object.next_weight = at.weight;
    }
    return object;
}

}  // namespace relume::render
