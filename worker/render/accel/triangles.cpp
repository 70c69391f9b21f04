#include "worker/render/accel/triangles.h"

#include <algorithm>
#include <cmath>

#include "core/math/frame.h"

namespace relume::render {
namespace {

void Quantize(Vec3f v, std::int16_t* out) {
    const float length = Length(v);
    const Vec3f unit = length > 0 ? v / length : Vec3f{0, 0, 1};
    for (int c = 0; c < 3; ++c) {
        out[c] = static_cast<std::int16_t>(std::lround(unit[c] * 32767));
    }
}

struct Tangents {
    std::vector<Vec3f> directions;  // one a position
    std::vector<float> signs;       // one a triangle
};

// Direction of growing u, averaged over the triangles at a vertex by area in uv; mirrored uvs keep
// a sign.
Tangents TangentsFromUvs(const Mesh& mesh) {
    Tangents t{std::vector<Vec3f>(mesh.positions.size()),
               std::vector<float>(mesh.triangles.size(), 1)};
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const Vec3u v = mesh.triangles[i];
        const Vec3f e1 = mesh.positions[v.y] - mesh.positions[v.x];
        const Vec3f e2 = mesh.positions[v.z] - mesh.positions[v.x];
        const Vec2f d1 = mesh.uvs[v.y] - mesh.uvs[v.x], d2 = mesh.uvs[v.z] - mesh.uvs[v.x];
        const float determinant = d1.x * d2.y - d1.y * d2.x;
        // v runs down the picture, and up in tangent space (glTF 2.0, 3.9.3): the sign follows.
        t.signs[i] = determinant < 0 ? 1.0f : -1.0f;
        Vec3f tangent = e1 * d2.y - e2 * d1.y;
        if (determinant < 0) {
            tangent = -tangent;
        }
        if (!IsFinite(tangent)) {
            continue;
        }
        for (const std::uint32_t k : {v.x, v.y, v.z}) {
            t.directions[k] += tangent;
        }
    }
    for (std::size_t k = 0; k < t.directions.size(); ++k) {
        if (!(Length2(t.directions[k]) > 0)) {
            t.directions[k] =
                Frame::FromZ(mesh.normals.empty() ? Vec3f{0, 1, 0} : mesh.normals[k]).x;
        }
    }
    return t;
}

// A positive float by its upper half, rounded up.
std::uint16_t UpperHalf(float v) {
    return static_cast<std::uint16_t>((std::bit_cast<std::uint32_t>(v) + 0xffffu) >> 16);
}

}  // namespace

float LargestEdge(const Mesh& mesh, Vec3u triangle) {
    const auto at = [triangle](const std::vector<Vec3f>& positions) {
        const Vec3f a = positions[triangle.x], b = positions[triangle.y], c = positions[triangle.z];
        const Vec3f box = Max(a, Max(b, c)) - Min(a, Min(b, c));
        return MaxComponent(box);
    };
    float largest = at(mesh.positions);
    for (const std::vector<Vec3f>& positions : mesh.motion) {
        largest = std::max(largest, at(positions));
    }
    return largest;
}

std::vector<TriangleData> GatherTriangles(const Mesh& mesh, bool tangents) {
    std::vector<TriangleData> gathered(mesh.triangles.size());
    const bool given = !mesh.tangents.empty();
    Tangents made;
    if (tangents && !given && !mesh.uvs.empty()) {
        made = TangentsFromUvs(mesh);
    }
    for (std::size_t i = 0; i < gathered.size(); ++i) {
        TriangleData& t = gathered[i];
        t = {};
        const Vec3u triangle = mesh.triangles[i];
        t.size = UpperHalf(LargestEdge(mesh, triangle));
        const std::uint32_t vertices[3] = {triangle.x, triangle.y, triangle.z};
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t v = vertices[k];
            if (!mesh.uvs.empty()) {
                t.uv[k] = mesh.uvs[v];
            }
            if (!mesh.normals.empty()) {
                Quantize(mesh.normals[v], t.normals[k]);
            }
            if (tangents && given) {
                Quantize(mesh.tangents[v], t.tangents[k]);
                const bool negative = v < mesh.tangent_signs.size() && mesh.tangent_signs[v] < 0;
                t.tangent_signs |= static_cast<std::uint16_t>(negative ? 1 << k : 0);
            } else if (!made.directions.empty()) {
                Quantize(made.directions[v], t.tangents[k]);
                t.tangent_signs |= static_cast<std::uint16_t>(made.signs[i] < 0 ? 1 << k : 0);
            }
        }
    }
    return gathered;
}

std::vector<UvGradients> GatherUvGradients(const Mesh& mesh) {
    std::vector<UvGradients> gradients(mesh.triangles.size());
    for (std::size_t i = 0; i < gradients.size(); ++i) {
        const Vec3u v = mesh.triangles[i];
        const Vec3f e1 = mesh.positions[v.y] - mesh.positions[v.x];
        const Vec3f e2 = mesh.positions[v.z] - mesh.positions[v.x];
        const Vec2f d1 = mesh.uvs[v.y] - mesh.uvs[v.x], d2 = mesh.uvs[v.z] - mesh.uvs[v.x];
        // The dual basis of the edges: r1 . e1 = 1, r1 . e2 = 0, and the other way round.
        const Vec3f n = Cross(e1, e2);
        const float n2 = Length2(n);
        const Vec3f r1 = Cross(e2, n) / n2, r2 = Cross(n, e1) / n2;
        const UvGradients g{r1 * d1.x + r2 * d2.x, r1 * d1.y + r2 * d2.y};
        if (n2 > 0 && IsFinite(g.u) && IsFinite(g.v)) {
            gradients[i] = g;
        }
    }
    return gradients;
}

void Object::SetTransform(const Transform& to_world) {
    transformed = !(to_world == Transform());
    const float determinant = to_world.Determinant();
    mirrored = determinant < 0;
    inverse_volume = 1 / std::abs(determinant);
    const Vec3f axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int c = 0; c < 3; ++c) {
        const Vec3f column = to_world.Vector(axes[c]), normal = to_world.Normal(axes[c]);
        for (int r = 0; r < 3; ++r) {
            linear[3 * r + c] = column[r];
            normals[3 * r + c] = normal[r];
        }
    }
    scale = 0;
    for (int r = 0; r < 3; ++r) {
        scale = std::max(scale, std::abs(linear[3 * r]) + std::abs(linear[3 * r + 1]) +
                                    std::abs(linear[3 * r + 2]));
    }
}

}  // namespace relume::render
