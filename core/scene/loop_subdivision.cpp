#include "core/scene/loop_subdivision.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace relume {
namespace {

struct Edge {
    std::uint32_t a = 0, b = 0;          // a < b
    std::uint32_t opposite[2] = {0, 0};  // third corners of the first two faces
    int faces = 0;
};

// A mesh's edges, and those of each face: xy, yz, zx.
struct Edges {
    std::vector<Edge> list;
    std::vector<Vec3u> of_face;

    explicit Edges(const std::vector<Vec3u>& triangles) : of_face(triangles.size()) {
        struct Side {
            std::uint64_t key;  // its corners, the smaller one first
            std::uint32_t face, side, opposite;
        };
        std::vector<Side> sides;
        sides.reserve(triangles.size() * 3);
        for (std::uint32_t i = 0; i < triangles.size(); ++i) {
            const Vec3u& t = triangles[i];
            sides.push_back({Key(t.x, t.y), i, 0, t.z});
            sides.push_back({Key(t.y, t.z), i, 1, t.x});
            sides.push_back({Key(t.z, t.x), i, 2, t.y});
        }
        std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
            return a.key != b.key ? a.key < b.key : a.face < b.face;
        });
        for (std::size_t i = 0; i < sides.size(); ++i) {
            const Side& side = sides[i];
            if (i == 0 || side.key != sides[i - 1].key) {
                list.push_back({static_cast<std::uint32_t>(side.key >> 32),
                                static_cast<std::uint32_t>(side.key),
                                {0, 0},
                                0});
            }
            Edge& edge = list.back();
            if (edge.faces < 2) {
                edge.opposite[edge.faces] = side.opposite;
            }
            ++edge.faces;
            (&of_face[side.face].x)[side.side] = static_cast<std::uint32_t>(list.size() - 1);
        }
    }

  private:
    static std::uint64_t Key(std::uint32_t a, std::uint32_t b) {
        return static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b);
    }
};

// What a vertex sees of its neighbours.
struct Ring {
    Vec3f sum, boundary_sum;  // of all neighbours; of those along the boundary
    int valence = 0, boundary = 0;
};

std::vector<Ring> Rings(const std::vector<Vec3f>& p, const Edges& edges) {
    std::vector<Ring> rings(p.size());
    for (const Edge& edge : edges.list) {
        for (const auto& [from, to] : {std::pair(edge.a, edge.b), std::pair(edge.b, edge.a)}) {
            Ring& ring = rings[from];
            ring.sum += p[to];
            ++ring.valence;
            if (edge.faces != 2) {
                ring.boundary_sum += p[to];
                ++ring.boundary;
            }
        }
    }
    return rings;
}

float Beta(int valence) {
    return valence == 3 ? 3.0f / 16 : 3.0f / (8 * static_cast<float>(valence));
}

// A vertex pulled towards its neighbours by `interior` each, or `boundary` along a boundary; where
// a boundary crosses itself it stays.
Vec3f Pull(Vec3f p, const Ring& ring, float interior, float boundary) {
    if (ring.valence == 0 || (ring.boundary != 0 && ring.boundary != 2)) {
        return p;
    }
    return ring.boundary == 2
               ? p * (1 - 2 * boundary) + ring.boundary_sum * boundary
               : p * (1 - static_cast<float>(ring.valence) * interior) + ring.sum * interior;
}

void Refine(std::vector<Vec3f>* positions, std::vector<Vec3u>* triangles) {
    const std::vector<Vec3f>& p = *positions;
    const Edges edges(*triangles);
    const std::vector<Ring> rings = Rings(p, edges);
    std::vector<Vec3f> refined(p.size() + edges.list.size());
    for (std::size_t i = 0; i < p.size(); ++i) {
        refined[i] = Pull(p[i], rings[i], Beta(std::max(rings[i].valence, 1)), 1.0f / 8);
    }
    for (std::size_t i = 0; i < edges.list.size(); ++i) {
        const Edge& e = edges.list[i];
        refined[p.size() + i] = e.faces == 2 ? (p[e.a] + p[e.b]) * (3.0f / 8) +
                                                   (p[e.opposite[0]] + p[e.opposite[1]]) * 0.125f
                                             : (p[e.a] + p[e.b]) * 0.5f;
    }
    std::vector<Vec3u> faces;
    faces.reserve(triangles->size() * 4);
    const auto first = static_cast<std::uint32_t>(p.size());
    for (std::size_t i = 0; i < triangles->size(); ++i) {
        const Vec3u& t = (*triangles)[i];
        const Vec3u& e = edges.of_face[i];
        const std::uint32_t xy = first + e.x, yz = first + e.y, zx = first + e.z;
        faces.push_back({t.x, xy, zx});
        faces.push_back({xy, t.y, yz});
        faces.push_back({zx, yz, t.z});
        faces.push_back({xy, yz, zx});
    }
    *positions = std::move(refined);
    *triangles = std::move(faces);
}

}  // namespace

void SubdivideLoop(int levels, std::vector<Vec3f>* positions, std::vector<Vec3u>* triangles) {
    for (int level = 0; level < levels; ++level) {
        Refine(positions, triangles);
    }
    const Edges edges(*triangles);
    const std::vector<Ring> rings = Rings(*positions, edges);
    std::vector<Vec3f> limit(positions->size());
    for (std::size_t i = 0; i < limit.size(); ++i) {
        const auto valence = static_cast<float>(std::max(rings[i].valence, 1));
        const float gamma = 1 / (valence + 3 / (8 * Beta(std::max(rings[i].valence, 1))));
        limit[i] = Pull((*positions)[i], rings[i], gamma, 1.0f / 5);
    }
    *positions = std::move(limit);
}

std::vector<Vec3f> SmoothNormals(const std::vector<Vec3f>& positions,
                                 const std::vector<Vec3u>& triangles) {
    std::vector<Vec3f> normals(positions.size());
    for (const Vec3u& t : triangles) {
        const Vec3f p = positions[t.x];
        const Vec3f n = Cross(positions[t.y] - p, positions[t.z] - p);
        normals[t.x] += n;
        normals[t.y] += n;
        normals[t.z] += n;
    }
    for (Vec3f& n : normals) {
        const float length = Length(n);
        n = length > 0 ? n * (1 / length) : Vec3f{0, 0, 1};
    }
    return normals;
}

}  // namespace relume
