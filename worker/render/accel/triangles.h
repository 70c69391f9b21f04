#pragma once

#include <bit>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/math/keys.h"
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

// What changes about an object while the shutter is open.
struct ObjectMotion {
    std::vector<Transform> to_world;  // at keys; empty: it stands still
    std::size_t shapes = 0;           // keys of its triangles' data; 0: one for all times
    std::size_t triangles = 0;        // to a key
};

// One entry a triangle. `tangents`: fill in tangents too (those of the mesh, or made from its uvs).
std::vector<TriangleData> GatherTriangles(const Mesh& mesh, bool tangents);

// Of a mesh that deforms, for each key one after the other. Its normals (and tangents) turn with
// the triangles around them: by the least rotation of the normal that these have on average.
std::vector<TriangleData> GatherMovingTriangles(const Mesh& mesh, bool tangents);

// How u and v grow over a triangle: object space, in its plane. Zero where the uvs say nothing. Of
// a mesh that deforms: as it is at first.
struct UvGradients {
    Vec3f u, v;
};
std::vector<UvGradients> GatherUvGradients(const Mesh& mesh);

// Largest coordinate of the edges of a triangle, at all times.
float LargestEdge(const Mesh& mesh, Vec3u triangle);

// An instance of a mesh, as shading sees it.
struct Object {
    const TriangleData* triangles = nullptr;       // null: flat and without uvs
    const TriangleData* next_triangles = nullptr;  // deforming, see At: those of the next key
    const UvGradients* gradients = nullptr;        // null: no bump map
    const ObjectMotion* motion = nullptr;          // null: as it is, at all times
    std::uint32_t material = 0;
    std::int32_t first_light =
        -1;                 // light of triangle 0; triangles follow in order; -1: not a light
    float next_weight = 0;  // of next_triangles
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
    // Not normalised; object space.
    Vec3f Normal(std::uint32_t triangle, float u, float v) const {
        const Vec3f n = triangles[triangle].Normal(u, v);
        return next_triangles == nullptr
                   ? n
                   : n + (next_triangles[triangle].Normal(u, v) - n) * next_weight;
    }
    Vec3f Tangent(std::uint32_t triangle, float u, float v) const {
        const Vec3f t = triangles[triangle].Tangent(u, v);
        return next_triangles == nullptr
                   ? t
                   : t + (next_triangles[triangle].Tangent(u, v) - t) * next_weight;
    }
    void SetTransform(const Transform& to_world);
    // As it is at a time in [0, 1]: itself, or made in `*moved`.
    const Object& At(float time, std::optional<Object>* moved) const {
        return motion == nullptr ? *this : MoveTo(time, moved);
    }

  private:
    const Object& MoveTo(float time, std::optional<Object>* moved) const;
    static Vec3f Multiply(const float* m, Vec3f v) {
        return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
                m[6] * v.x + m[7] * v.y + m[8] * v.z};
    }
};

}  // namespace relume::render
