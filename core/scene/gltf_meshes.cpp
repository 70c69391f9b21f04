#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/scene/gltf_deform.h"

// Meshes (section 3.7.2): each primitive of triangles becomes a Mesh of its own, since it has its
// own material. Points and lines have no surface, and are left out. Attributes that the material
// doesn't look at are not read: texture coordinates without a texture, tangents without a normal
// map. Tangents that lack are made by the renderer.

namespace relume::gltf {
namespace {

bool HasAnyTexture(const Material& material) {
    constexpr std::string_view kSuffix = "_texture";
    for (const auto& [name, value] : material.params.values()) {
        if (name.size() > kSuffix.size() && name.ends_with(kSuffix)) {
            return true;
        }
    }
    return false;
}

std::vector<Vec3f> Triples(const std::vector<float>& numbers) {
    std::vector<Vec3f> out(numbers.size() / 3);
    for (std::size_t i = 0; i < out.size(); ++i) {
        out[i] = {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
    }
    return out;
}

// Twice the area is the length of it; zero if two corners are the same or all are on a line.
Vec3f AreaVector(const Mesh& mesh, const Vec3u& t) {
    const Vec3f p = mesh.positions[t.x];
    return Cross(mesh.positions[t.y] - p, mesh.positions[t.z] - p);
}

// The corners of triangle `i` among the indices (section 3.7.2.1); every other one of a strip is
// turned so that all have the same front.
Vec3u Corners(int mode, std::uint32_t i) {
    switch (mode) {
        case TINYGLTF_MODE_TRIANGLE_STRIP:
            return i % 2 == 0 ? Vec3u{i, i + 1, i + 2} : Vec3u{i, i + 2, i + 1};
        case TINYGLTF_MODE_TRIANGLE_FAN:
            return {i + 1, i + 2, 0};
        default:
            return {3 * i, 3 * i + 1, 3 * i + 2};
    }
}

class PrimitiveReader {
  public:
    PrimitiveReader(const Data& data, const tinygltf::Primitive& primitive, SourceLocation source,
                    Notes* notes)
        : data_(data), primitive_(primitive), notes_(notes) {
        mesh_.source = std::move(source);
    }

    // `uv_set`: n of the TEXCOORD_n to read.
    Mesh Read(const Material& material, int uv_set) {
        const auto position = Find("POSITION");
        if (!position) {
            Fail(mesh_.source, "has no POSITION attribute; remove the mesh or export it again");
        }
        mesh_.positions = Triples(data_.Floats(*position, 3, At("POSITION")));
        ReadTriangles();
        ReadNormals();
        ReadUvs(material, uv_set);
        ReadTangents(material);
        NoteIgnored();
        return std::move(mesh_);
    }

  private:
    std::optional<int> Find(const char* attribute) const {
        const auto it = primitive_.attributes.find(attribute);
        return it == primitive_.attributes.end() ? std::nullopt : std::optional<int>(it->second);
    }

    SourceLocation At(const char* what) const { return mesh_.source + ": " + what; }

    void ReadTriangles() {
        std::vector<std::uint32_t> indices;
        const bool indexed = primitive_.indices >= 0;
        if (indexed) {
            indices = data_.Indices(primitive_.indices, At("indices"));
        }
        const std::size_t count = indexed ? indices.size() : mesh_.positions.size();
        const bool list = primitive_.mode == TINYGLTF_MODE_TRIANGLES;
        if (list && count % 3 != 0) {
            Fail(mesh_.source, fmt::format("its {} corners are not whole triangles; export the "
                                           "scene again",
                                           count));
        }
        const std::size_t triangle_count = list ? count / 3 : count < 3 ? 0 : count - 2;
        mesh_.triangles.reserve(triangle_count);
        bool has_area = false;
        for (std::size_t i = 0; i < triangle_count; ++i) {
            Vec3u t = Corners(primitive_.mode, static_cast<std::uint32_t>(i));
            for (std::uint32_t* corner : {&t.x, &t.y, &t.z}) {
                const std::uint32_t at = *corner;
                *corner = indexed ? indices[at] : at;
                if (*corner >= mesh_.positions.size()) {
                    Fail(mesh_.source,
                         fmt::format("index {} refers to vertex {} of {}; export the scene again",
                                     at, *corner, mesh_.positions.size()));
                }
            }
            // Strips are stitched together by such ones.
            if (!list && (t.x == t.y || t.y == t.z || t.z == t.x)) {
                continue;
            }
            has_area = has_area || !(Length2(AreaVector(mesh_, t)) == 0);  // NaN: told later
            mesh_.triangles.push_back(t);
        }
        if (!has_area) {
            mesh_.triangles.clear();  // ValidateScene says so
        }
    }

    void ReadNormals() {
        const auto normal = Find("NORMAL");
        if (!normal) {
            return;
        }
        mesh_.normals = Triples(data_.Floats(*normal, 3, At("NORMAL")));
        bool has_zero = false;
        for (Vec3f& n : mesh_.normals) {
            const float length = Length(n);
            has_zero = has_zero || length == 0;
            n = length == 0 ? n : n / length;
        }
        if (has_zero && mesh_.normals.size() == mesh_.positions.size()) {
            notes_->Add(mesh_.source +
                        ": normals of length 0 are replaced by those of the triangles around");
            ReplaceZeroNormals();
        }
    }

    void ReplaceZeroNormals() {
        std::vector<Vec3f> sums(mesh_.normals.size());
        for (const Vec3u& t : mesh_.triangles) {
            const Vec3f area = AreaVector(mesh_, t);
            for (const std::uint32_t corner : {t.x, t.y, t.z}) {
                sums[corner] += area;
            }
        }
        for (std::size_t i = 0; i < sums.size(); ++i) {
            if (Length2(mesh_.normals[i]) == 0) {
                const float length = Length(sums[i]);
                mesh_.normals[i] = length > 0 ? sums[i] / length : Vec3f{0, 1, 0};
            }
        }
    }

    void ReadUvs(const Material& material, int uv_set) {
        if (!HasAnyTexture(material)) {
            return;
        }
        const std::string name = fmt::format("TEXCOORD_{}", uv_set);
        const auto uv = Find(name.c_str());
        if (!uv) {
            notes_->Add(fmt::format("{}: has no {}: its textures show their corner pixel alone",
                                    mesh_.source, name));
            return;
        }
        const std::vector<float> numbers = data_.Floats(*uv, 2, At(name.c_str()));
        mesh_.uvs.resize(numbers.size() / 2);
        for (std::size_t i = 0; i < mesh_.uvs.size(); ++i) {
            mesh_.uvs[i] = {numbers[2 * i], numbers[2 * i + 1]};
        }
    }

    // Tangents without normals must be ignored (section 3.7.2.1).
    void ReadTangents(const Material& material) {
        const auto tangent = Find("TANGENT");
        if (!tangent || mesh_.normals.empty() ||
            !(material.params.Has("normal_texture") ||
              material.params.Has("clearcoat_normal_texture"))) {
            return;
        }
        const std::vector<float> numbers = data_.Floats(*tangent, 4, At("TANGENT"));
        const std::size_t count = numbers.size() / 4;
        mesh_.tangents.reserve(count);
        mesh_.tangent_signs.reserve(count);
        for (std::size_t i = 0; i < count; ++i) {
            const float* n = &numbers[4 * i];
            const Vec3f direction{n[0], n[1], n[2]};
            const float length = Length(direction);
            if (!(length > 0) || !std::isfinite(length)) {
                notes_->Add(mesh_.source +
                            ": has tangents of no direction: all are made from texture "
                            "coordinates instead");
                mesh_.tangents.clear();
                mesh_.tangent_signs.clear();
                return;
            }
            mesh_.tangents.push_back(direction / length);
            mesh_.tangent_signs.push_back(n[3] < 0 ? -1.0f : 1.0f);
        }
    }

    void NoteIgnored() {
        if (Find("COLOR_0")) {
            notes_->Add("vertex colours (COLOR_0) are ignored");
        }
    }

    const Data& data_;
    const tinygltf::Primitive& primitive_;
    Notes* notes_;
    Mesh mesh_;
};

bool IsTriangles(const tinygltf::Primitive& primitive, const SourceLocation& place, Notes* notes) {
    if (primitive.mode < TINYGLTF_MODE_POINTS || primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN) {
        Fail(place, fmt::format("mode {} is not known; export the scene again", primitive.mode));
    }
    if (primitive.mode < TINYGLTF_MODE_TRIANGLES) {
        notes->Add("points and lines are left out: they have no surface");
        return false;
    }
    return true;
}

}  // namespace

void ReadMeshes(const Document& document, const Data& data, const Poses& poses,
                const Placed& placed, const Look& look, Scene* scene, Notes* notes) {
    Deformer deformer(document, data, poses, placed);
    // From the file's index, and that of the node if the mesh deforms there, to Scene's.
    std::map<std::pair<int, int>, std::vector<int>> meshes_of;
    for (const Placed::MeshUse& use : placed.meshes) {
        const bool deforms = deformer.Deforms(use);
        const auto [it, is_new] = meshes_of.try_emplace({use.mesh, deforms ? use.node : -1});
        if (is_new) {
            const auto index = static_cast<std::size_t>(use.mesh);
            const tinygltf::Mesh& from = document.model.meshes[index];
            const SourceLocation place = document.Place("mesh", index, from.name);
            if (from.primitives.empty()) {
                Fail(place, "the mesh is empty (no primitives); remove or repair it");
            }
            for (std::size_t i = 0; i < from.primitives.size(); ++i) {
                const tinygltf::Primitive& primitive = from.primitives[i];
                const SourceLocation source = fmt::format("{}, primitive {}", place, i);
                if (!IsTriangles(primitive, source, notes)) {
                    continue;
                }
                const int material = look.material_of.at(std::max(primitive.material, -1));
                const auto looks = static_cast<std::size_t>(material);
                Mesh mesh = PrimitiveReader(data, primitive, source, notes)
                                .Read(look.materials[looks], look.uv_sets[looks]);
                mesh.name = from.name;
                mesh.material = material;
                if (deforms) {
                    deformer.Deform(primitive, use, &mesh);
                }
                it->second.push_back(static_cast<int>(scene->meshes.size()));
                scene->meshes.push_back(std::move(mesh));
            }
        }
        // A skin puts the mesh into the world by itself.
        const SampledTransform to_world =
            use.skin >= 0 ? SampledTransform{Transform()} : use.to_world;
        for (const int mesh : it->second) {
            scene->instances.push_back({mesh, to_world.front(), MotionKeys(to_world)});
        }
    }
}

}  // namespace relume::gltf
