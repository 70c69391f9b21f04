#include <fmt/format.h>

#include <cstring>
#include <unordered_map>
#include <utility>

#include "core/base/parallel.h"
#include "core/scene/obj.h"
#include "core/scene/polygon.h"

namespace relume::obj {
namespace {

struct KeyHash {
    std::size_t operator()(const std::array<int, 4>& key) const {
        std::uint64_t hash = 0x9e3779b97f4a7c15u;
        for (const int part : key) {
            hash = (hash ^ static_cast<std::uint32_t>(part)) * 0xff51afd7ed558ccdu;
            hash ^= hash >> 32;
        }
        return static_cast<std::size_t>(hash);
    }
};

Vec3f AreaVector(const std::vector<Vec3f>& corners) {
    Vec3f sum{0, 0, 0};
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
        sum += Cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
    }
    return sum;
}

Vec3f Unit(Vec3f v) {
    const float length = Length(v);
    return length > 0 ? v / length : Vec3f{0, 1, 0};
}

// Of an unordered_map of keys like these: what an entry takes, with its links and its share of the
// table.
constexpr std::uint64_t kEntryBytes = 56;

class Maker {
  public:
    Maker(const Document& document, ArrayRoom* room) : document_(document), room_(room) {
        for (const Part& part : document.parts) {
            if (part.smoothing > 0) {
                AddSmooth(part, End(part));
            }
        }
    }

    // The face after a part's last one.
    std::size_t End(const Part& part) const {
        const std::size_t next = static_cast<std::size_t>(&part - document_.parts.data()) + 1;
        return next < document_.parts.size() ? document_.parts[next].first_face
                                             : document_.faces.size() - 1;
    }

    void Make(const std::vector<const Part*>& parts, Mesh* mesh) const {
        bool any_normals = false, any_uvs = false;
        for (const Part* part : parts) {
            any_normals = any_normals || part->smoothing > 0;
            ForCorners(*part, [&](const Corner& corner) {
                any_normals = any_normals || corner.normal >= 0;
                any_uvs = any_uvs || corner.uv >= 0;
            });
        }
        std::unordered_map<std::array<int, 4>, std::uint32_t, KeyHash> vertex_of;
        std::vector<Vec3u> triangles;
        std::vector<std::uint32_t> vertices;
        std::vector<Vec3f> positions;
        const auto place = [&] { return mesh->source; };
        for (const Part* part : parts) {
            for (std::size_t face = part->first_face; face < End(*part); ++face) {
                GetPositions(face, &positions);
                const Vec3f flat = Unit(AreaVector(positions));
                vertices.clear();
                for (std::size_t i = document_.faces[face]; i < document_.faces[face + 1]; ++i) {
                    const Corner& corner = document_.corners[i];
                    // How it comes by its normal: given, of its smoothing group, of its face.
                    std::array<int, 4> key{corner.position, corner.uv, 0, 0};
                    if (any_normals) {
                        key[2] = corner.normal >= 0 ? 0 : part->smoothing > 0 ? 1 : 2;
                        key[3] = corner.normal >= 0    ? corner.normal
                                 : part->smoothing > 0 ? part->smoothing
                                                       : static_cast<int>(face);
                    }
                    const auto [it, is_new] = vertex_of.try_emplace(
                        key, static_cast<std::uint32_t>(mesh->positions.size()));
                    if (is_new) {
                        if (mesh->positions.size() == mesh->positions.capacity()) {
                            room_->Take(std::max<std::size_t>(mesh->positions.size(), 1) *
                                            (kEntryBytes + (any_normals ? sizeof(Vec3f) : 0) +
                                             (any_uvs ? sizeof(Vec2f) : 0)),
                                        place);
                        }
                        room_->ForOneMore(mesh->positions, place);
                        AddVertex(corner, *part, any_normals, any_uvs, flat, mesh);
                    }
                    vertices.push_back(it->second);
                }
                triangles.clear();
                Triangulate(positions, &triangles);
                for (const Vec3u& t : triangles) {
                    const Vec3u triangle{vertices[t.x], vertices[t.y], vertices[t.z]};
                    const Vec3f p = mesh->positions[triangle.x];
                    const Vec3f area =
                        Cross(mesh->positions[triangle.y] - p, mesh->positions[triangle.z] - p);
                    if (Length2(area) > 0) {  // files have many without an area
                        room_->ForOneMore(mesh->triangles, place);
                        mesh->triangles.push_back(triangle);
                    }
                }
            }
        }
        room_->Release(mesh->positions.capacity() * kEntryBytes);
    }

  private:
    template <class F>
    void ForCorners(const Part& part, F&& f) const {
        for (std::size_t i = document_.faces[part.first_face]; i < document_.faces[End(part)];
             ++i) {
            f(document_.corners[i]);
        }
    }

    void GetPositions(std::size_t face, std::vector<Vec3f>* positions) const {
        positions->clear();
        for (std::size_t i = document_.faces[face]; i < document_.faces[face + 1]; ++i) {
            positions->push_back(
                document_.positions[static_cast<std::size_t>(document_.corners[i].position)]);
        }
    }

    void AddSmooth(const Part& part, std::size_t end) {
        std::vector<Vec3f> positions;
        for (std::size_t face = part.first_face; face < end; ++face) {
            GetPositions(face, &positions);
            const Vec3f area = AreaVector(positions);
            for (std::size_t i = document_.faces[face]; i < document_.faces[face + 1]; ++i) {
                if (document_.corners[i].normal < 0) {
                    const auto [sum, is_new] = smooth_.try_emplace(
                        {document_.corners[i].position, part.smoothing, 0, 0}, Vec3f{0, 0, 0});
                    if (is_new) {
                        room_->Take(kEntryBytes, [&] { return part.place.Text(); });
                    }
                    sum->second += area;
                }
            }
        }
    }

    void AddVertex(const Corner& corner, const Part& part, bool normals, bool uvs, Vec3f flat,
                   Mesh* mesh) const {
        mesh->positions.push_back(document_.positions[static_cast<std::size_t>(corner.position)]);
        if (uvs) {
            const Vec2f uv =
                corner.uv < 0 ? Vec2f{0, 0} : document_.uvs[static_cast<std::size_t>(corner.uv)];
            mesh->uvs.push_back({uv.x, 1 - uv.y});
        }
        if (normals) {
            Vec3f normal = flat;
            if (corner.normal >= 0) {
                const Vec3f given = document_.normals[static_cast<std::size_t>(corner.normal)];
                normal = Length2(given) > 0 ? Unit(given) : flat;
            } else if (part.smoothing > 0) {
                const Vec3f sum = smooth_.at({corner.position, part.smoothing, 0, 0});
                normal = Length2(sum) > 0 ? Unit(sum) : flat;
            }
            mesh->normals.push_back(normal);
        }
    }

    const Document& document_;
    ArrayRoom* room_;
    // Sums of faces' area vectors by position and smoothing group.
    std::unordered_map<std::array<int, 4>, Vec3f, KeyHash> smooth_;
};

}  // namespace

void MakeMeshes(const Document& document, const std::vector<int>& material_of, Scene* scene,
                Notes* notes, ArrayRoom* room) {
    std::map<std::pair<std::string, int>, std::size_t> known;
    std::vector<std::vector<const Part*>> plans;
    for (const Part& part : document.parts) {
        const auto [it, is_new] = known.try_emplace({part.name, part.material}, plans.size());
        if (is_new) {
            plans.emplace_back();
        }
        plans[it->second].push_back(&part);
    }
    const Maker maker(document, room);
    std::vector<Mesh> meshes;
    room->Reserve(&meshes, plans.size(), [&] { return document.names.front(); });
    meshes.resize(plans.size());
    ParallelFor(0, plans.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Part& first = *plans[i].front();
            meshes[i].name = first.name;
            meshes[i].material = material_of[static_cast<std::size_t>(first.material + 1)];
            meshes[i].source = first.place.Text() +
                               (first.name.empty() ? "" : fmt::format(": group '{}'", first.name));
            maker.Make(plans[i], &meshes[i]);
        }
    });
    for (std::size_t i = 0; i < plans.size(); ++i) {
        if (meshes[i].triangles.empty()) {
            notes->Add(plans[i].front()->place, "groups whose faces have no area are left out");
            continue;
        }
        scene->instances.push_back({static_cast<int>(scene->meshes.size()), Transform()});
        scene->meshes.push_back(std::move(meshes[i]));
    }
}

}  // namespace relume::obj
