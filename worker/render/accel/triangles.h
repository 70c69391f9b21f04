#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "core/math/transform.h"
#include "core/math/vec.h"
#include "core/scene/scene.h"

namespace relume::render {

// What shading wants of a triangle, gathered on one cache line: a hit reads one line instead of
// thirteen.
struct alignas(64) TriangleData {
    Vec2f uv[3];
    std::int16_t normals[3][3];   // object space, times 32767
    std::int16_t tangents[3][3];  // object space, times 32767
    std::uint16_t tangent_signs;  // bit i set: that vertex's bitangent is -cross(normal, tangent)
    std::uint16_t size;           // see Size

    // Largest coordinate of the edges, object space, rounded up: the scale of the rounding errors
    // of hits.
    float Size() const { return std::bit_cast<float>(static_cast<std::uint32_t>(size) << 16); }

    Vec2f Uv(float u, float v) const { return uv[0] * (1 - u - v) + uv[1] * u + uv[2] * v; }
    // Not normalised.
    Vec3f Normal(float u, float v) const { return Interpolate(normals, u, v); }
    Vec3f Tangent(float u, float v) const { return Interpolate(tangents, u, v); }

  private:
    static Vec3f Interpolate(const std::int16_t (&n)[3][3], float u, float v) {
        const float w = 1 - u - v;
        return {w * n[0][0] + u * n[1][0] + v * n[2][0], w * n[0][1] + u * n[1][1] + v * n[2][1],
                w * n[0][2] + u * n[1][2] + v * n[2][2]};
    }
};
static_assert(sizeof(TriangleData) == 64);

// One entry a triangle. `tangents`: fill in tangents too (those of the mesh, or made from its uvs).
std::vector<TriangleData> GatherTriangles(const Mesh& mesh, bool tangents);

// How u and v grow over a triangle: object space, in its plane. Zero where the uvs say nothing.
struct UvGradients {
    Vec3f u, v;
};
std::vector<UvGradients> GatherUvGradients(const Mesh& mesh);

// Largest coordinate of the edges of a triangle.
float LargestEdge(const Mesh& mesh, Vec3u triangle);

// An instance of a mesh, as shading sees it.
struct Object {
    const TriangleData* triangles = nullptr;  // null: flat and without uvs
    const UvGradients* gradients = nullptr;   // null: no bump map
    std::uint32_t material = 0;
    std::int32_t first_light =
        -1;  // light of triangle 0; triangles follow in order; -1: not a light
    bool has_normals = false;
    bool nested = false;       // Embree gives normals in object space
    bool transformed = false;  // object space is not world space
    bool mirrored = false;     // the transform turns triangles inside out
    float extent = 0;  // world space: the scale of rounding errors that all its triangles share
    float scale = 1;   // object to world: bound of how much a largest coordinate grows
    float inverse_volume = 1;                        // 1 / |determinant| of the transform
    float linear[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};   // rows: object to world, for tangents
    float normals[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // its transposed inverse, scaled, for normals

    Vec3f TransformTangent(Vec3f t) const { return transformed ? Multiply(linear, t) : t; }
    Vec3f TransformNormal(Vec3f n) const { return transformed ? Multiply(normals, n) : n; }
    Vec3f TransformGradient(Vec3f g) const { return TransformNormal(g) * inverse_volume; }
    void SetTransform(const Transform& to_world);

  private:
    static Vec3f Multiply(const float* m, Vec3f v) {
        return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
                m[6] * v.x + m[7] * v.y + m[8] * v.z};
    }
};

}  // namespace relume::render
