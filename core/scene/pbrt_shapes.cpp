#include "core/scene/pbrt_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/scene/loop_subdivision.h"
#include "core/scene/ply.h"

namespace relume::pbrt {
namespace {

void Require(bool good, const Declared& shape, const std::string& problem) {
    if (!good) {
        Fail(shape.place, fmt::format("{}: {}; export the scene again", shape.type, problem));
    }
}

// "integer indices", in groups of `corners`; without them, the vertices in order if there is one
// group.
std::vector<std::uint32_t> Indices(const Declared& shape, std::size_t corners,
                                   std::size_t vertices) {
    const std::vector<int> given = shape.params.Ints("indices");
    std::vector<std::uint32_t> indices;
    if (given.empty() && vertices == corners) {
        for (std::uint32_t i = 0; i < corners; ++i) {
            indices.push_back(i);
        }
        return indices;
    }
    Require(!given.empty(), shape, "it has no indices");
    Require(given.size() % corners == 0, shape,
            fmt::format("{} indices are not {} a face", given.size(), corners));
    indices.reserve(given.size());
    for (const int index : given) {
        Require(index >= 0 && static_cast<std::size_t>(index) < vertices, shape,
                fmt::format("index {} of {} vertices P", index, vertices));
        indices.push_back(static_cast<std::uint32_t>(index));
    }
    return indices;
}

// P, N and uv of a mesh. Texture coordinates have had several names.
void ReadVertices(const Declared& shape, Mesh* mesh) {
    const Params& params = shape.params;
    mesh->positions = params.Points("P");
    mesh->normals = params.Points("N");
    for (const char* name : {"uv", "st"}) {
        if (mesh->uvs.empty()) {
            mesh->uvs = params.Points2(name);
        }
    }
    params.Ignore("S faceIndices");  // tangents: only for hair; faces: only for Ptex
    const std::size_t n = mesh->positions.size();
    Require(n > 0, shape, "it has no vertices P");
    Require(mesh->normals.empty() || mesh->normals.size() == n, shape,
            fmt::format("{} normals N for {} vertices P", mesh->normals.size(), n));
    Require(mesh->uvs.empty() || mesh->uvs.size() == n, shape,
            fmt::format("{} texture coordinates uv for {} vertices P", mesh->uvs.size(), n));
}

void MakeTriangles(const Declared& shape, Mesh* mesh) {
    ReadVertices(shape, mesh);
    const std::vector<std::uint32_t> indices = Indices(shape, 3, mesh->positions.size());
    mesh->triangles.reserve(indices.size() / 3);
    for (std::size_t i = 0; i < indices.size(); i += 3) {
        mesh->triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
    }
}

void MakePly(const Declared& shape, const FileSource& files, Mesh* mesh, ArrayRoom* room) {
    const std::string name = PathToName(shape.params.String("filename", ""), shape.place);
    try {
        PlyMesh ply = ReadPly(files.Read(name), name, room);
        mesh->positions = std::move(ply.positions);
        mesh->normals = std::move(ply.normals);
        mesh->uvs = std::move(ply.uvs);
        mesh->triangles = std::move(ply.triangles);
    } catch (const Error& error) {
        throw Error(error.code(), fmt::format("{}: {}", shape.place.Text(), error.what()));
    }
}

// The corners of a bilinear patch, p(u, v): v runs from c[0] to c[2].
template <class T>
T Bilinear(const T (&c)[4], float u, float v) {
    return (c[0] * (1 - u) + c[1] * u) * (1 - v) + (c[2] * (1 - u) + c[3] * u) * v;
}

// Parallelograms are two triangles, other patches 8 x 8 quads with the patch's own normals.
void MakeBilinear(const Declared& shape, Mesh* mesh, Notes* notes, ArrayRoom* room) {
    Mesh in;
    ReadVertices(shape, &in);
    if (!shape.params.String("emissionfilename", "").empty()) {
        notes->Add(shape.place, "bilinearmesh: the emission image is ignored");
    }
    const std::vector<std::uint32_t> indices = Indices(shape, 4, in.positions.size());
    bool curved = false;
    std::size_t vertices = 0, triangles = 0;  // of all patches
    for (const bool making : {false, true}) {
        if (making) {
            const auto place = [&] { return shape.place.Text(); };
            room->Reserve(&mesh->positions, vertices, place);
            room->Reserve(&mesh->uvs, vertices, place);
            room->Reserve(&mesh->normals, curved || !in.normals.empty() ? vertices : 0, place);
            room->Reserve(&mesh->triangles, triangles, place);
        }
        for (std::size_t i = 0; i < indices.size(); i += 4) {
            Vec3f p[4], n[4];
            Vec2f uv[4] = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
            for (std::size_t k = 0; k < 4; ++k) {
                const std::uint32_t index = indices[i + k];
                p[k] = in.positions[index];
                n[k] = in.normals.empty() ? Vec3f{} : in.normals[index];
                uv[k] = in.uvs.empty() ? uv[k] : in.uvs[index];
            }
            const Vec3f defect = p[0] + p[3] - p[1] - p[2];
            const bool flat =
                Length2(defect) <= 1e-8f * std::max(Length2(p[3] - p[0]), Length2(p[2] - p[1]));
            const std::uint32_t cells = flat ? 1 : 8;
            if (!making) {
                curved = curved || !flat;
                vertices += (cells + 1) * (cells + 1);
                triangles += 2 * cells * cells;
                continue;
            }
            const auto first = static_cast<std::uint32_t>(mesh->positions.size());
            for (std::uint32_t y = 0; y <= cells; ++y) {
                for (std::uint32_t x = 0; x <= cells; ++x) {
                    const float u = static_cast<float>(x) / static_cast<float>(cells);
                    const float v = static_cast<float>(y) / static_cast<float>(cells);
                    mesh->positions.push_back(Bilinear(p, u, v));
                    mesh->uvs.push_back(Bilinear(uv, u, v));
                    if (!in.normals.empty()) {
                        mesh->normals.push_back(Bilinear(n, u, v));
                    } else if (curved) {
                        const Vec3f du = Lerp(v, p[1] - p[0], p[3] - p[2]);
                        const Vec3f dv = Lerp(u, p[2] - p[0], p[3] - p[1]);
                        mesh->normals.push_back(Cross(du, dv));
                    }
                }
            }
            for (std::uint32_t y = 0; y < cells; ++y) {
                for (std::uint32_t x = 0; x < cells; ++x) {
                    const std::uint32_t a = first + y * (cells + 1) + x, b = a + 1,
                                        c = a + cells + 1, d = c + 1;
                    mesh->triangles.push_back({a, b, d});
                    mesh->triangles.push_back({a, d, c});
                }
            }
        }
    }
}

void MakeLoop(const Declared& shape, Mesh* mesh, Notes* notes, ArrayRoom* room) {
    constexpr std::size_t kMostFaces = std::size_t{1} << 21;
    mesh->positions = shape.params.Points("P");
    Require(!mesh->positions.empty(), shape, "it has no vertices P");
    const std::vector<std::uint32_t> indices = Indices(shape, 3, mesh->positions.size());
    for (std::size_t i = 0; i < indices.size(); i += 3) {
        mesh->triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
    }
    shape.params.Ignore("scheme");
    const int wanted = std::max(0, shape.params.Int("levels", shape.params.Int("nlevels", 3)));
    int levels = 0;
    std::size_t faces = mesh->triangles.size();
    for (; levels < wanted && faces * 4 <= kMostFaces; faces *= 4) {
        ++levels;
    }
    // Refined, there are half as many vertices as faces.
    room->Take(faces * (sizeof(Vec3u) + sizeof(Vec3f)), [&] { return shape.place.Text(); });
    if (levels < wanted) {
        notes->Add(shape.place, fmt::format("loopsubdiv: refined {} times instead of {}: a mesh "
                                            "may have {} faces",
                                            levels, wanted, kMostFaces));
    }
    SubdivideLoop(levels, &mesh->positions, &mesh->triangles);
    mesh->normals = SmoothNormals(mesh->positions, mesh->triangles);
}

// Unit length; where a normal has none, the faces' around.
void NormalizeNormals(Mesh* mesh) {
    std::vector<Vec3f> smooth;
    for (std::size_t i = 0; i < mesh->normals.size(); ++i) {
        Vec3f& n = mesh->normals[i];
        const float length = Length(n);
        if (length > 0 && std::isfinite(length)) {
            n = n * (1 / length);
        } else if (IsFinite(n)) {
            if (smooth.empty()) {
                smooth = SmoothNormals(mesh->positions, mesh->triangles);
            }
            n = smooth[i];
        }
    }
}

// As pbrt does at each hit: a triangle's front is where its normals point.
void FaceNormals(Mesh* mesh) {
    for (Vec3u& t : mesh->triangles) {
        const Vec3f p = mesh->positions[t.x];
        const Vec3f front = Cross(mesh->positions[t.y] - p, mesh->positions[t.z] - p);
        const Vec3f n = mesh->normals[t.x] + mesh->normals[t.y] + mesh->normals[t.z];
        if (Dot(front, n) < 0) {
            std::swap(t.y, t.z);
        }
    }
}

}  // namespace

bool IsSupportedShape(const std::string& type) {
    constexpr const char* kTypes[] = {"trianglemesh", "plymesh",    "sphere",       "disk",
                                      "cylinder",     "loopsubdiv", "bilinearmesh", "curve"};
    return std::find(std::begin(kTypes), std::end(kTypes), type) != std::end(kTypes);
}

std::string PlyName(const Shape& shape) {
    return PathToName(shape.is.params.String("filename", ""), shape.is.place);
}

void MakeMesh(const std::vector<const Shape*>& shapes, const FileSource& files, Mesh* mesh,
              Notes* notes, ArrayRoom* room) {
    const Shape& shape = *shapes.front();
    const std::string& type = shape.is.type;
    mesh->source = fmt::format("{}: {}", shape.is.place.Text(), type);
    // What the file says becomes arrays of about the same size.
    room->Take(shape.is.params.bytes(), [&] { return shape.is.place.Text(); });
    if (type == "trianglemesh") {
        MakeTriangles(shape.is, mesh);
    } else if (type == "plymesh") {
        MakePly(shape.is, files, mesh, room);
        mesh->source += fmt::format(" '{}'", PlyName(shape));
    } else if (type == "bilinearmesh") {
        MakeBilinear(shape.is, mesh, notes, room);
    } else if (type == "loopsubdiv") {
        MakeLoop(shape.is, mesh, notes, room);
    } else if (type == "curve") {
        for (const Shape* curve : shapes) {
            AddCurve(curve->is, mesh, notes, room);
        }
    } else {
        MakeQuadric(shape.is, mesh);
        room->Take(mesh->positions.size() * (2 * sizeof(Vec3f) + sizeof(Vec2f)) +
                       mesh->triangles.size() * sizeof(Vec3u),
                   [&] { return shape.is.place.Text(); });
    }
    NormalizeNormals(mesh);
    if (!mesh->normals.empty() && type != "loopsubdiv" && type != "curve") {
        FaceNormals(mesh);
    }
    if (shape.reverse) {
        for (Vec3u& t : mesh->triangles) {
            std::swap(t.y, t.z);
        }
        for (Vec3f& n : mesh->normals) {
            n = -n;
        }
    }
    for (Vec2f& uv : mesh->uvs) {
        uv.y = 1 - uv.y;
    }
}

void AddDefaultUvs(Mesh* mesh, ArrayRoom* room) {
    Mesh unshared;
    const std::size_t corners = 3 * mesh->triangles.size();
    const auto place = [&] { return mesh->source; };
    room->Reserve(&unshared.positions, corners, place);
    room->Reserve(&unshared.normals, mesh->normals.empty() ? 0 : corners, place);
    room->Reserve(&unshared.uvs, corners, place);
    for (Vec3u& t : mesh->triangles) {
        const auto first = static_cast<std::uint32_t>(unshared.positions.size());
        for (const std::uint32_t corner : {t.x, t.y, t.z}) {
            unshared.positions.push_back(mesh->positions[corner]);
            if (!mesh->normals.empty()) {
                unshared.normals.push_back(mesh->normals[corner]);
            }
        }
        for (const Vec2f uv : {Vec2f{0, 1}, Vec2f{1, 1}, Vec2f{1, 0}}) {  // v runs down
            unshared.uvs.push_back(uv);
        }
        t = {first, first + 1, first + 2};
    }
    mesh->positions = std::move(unshared.positions);
    mesh->normals = std::move(unshared.normals);
    mesh->uvs = std::move(unshared.uvs);
}

}  // namespace relume::pbrt
