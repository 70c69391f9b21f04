#include <cmath>

#include "core/scene/loop_subdivision.h"
#include "tests/unit/scene/pbrt_file.h"

namespace relume::test {
namespace {

using testing::HasSubstr;

// The first shape of a world.
struct Loaded {
    Mesh mesh;
    Transform to_world;
};
Loaded LoadShape(const std::string& text, const PbrtFiles& files = {}) {
    Scene scene = LoadPbrtWorld(text + "\n", files);
    const Instance instance = scene.instances.at(0);
    return {scene.meshes[static_cast<std::size_t>(instance.mesh)], instance.to_world};
}

// As the renderer sees it: in the world, with a mirror's effect on the winding undone.
Mesh InWorld(const Loaded& loaded) {
    Mesh mesh = loaded.mesh;
    for (Vec3f& p : mesh.positions) {
        p = loaded.to_world.Point(p);
    }
    for (Vec3f& n : mesh.normals) {
        n = Normalize(loaded.to_world.Normal(n));
    }
    if (loaded.to_world.Determinant() < 0) {
        for (Vec3u& t : mesh.triangles) {
            std::swap(t.y, t.z);
        }
    }
    return mesh;
}

// The front of a mesh's first triangle.
Vec3f Front(const Mesh& mesh) {
    const Vec3u t = mesh.triangles.at(0);
    return Normalize(Cross(mesh.positions[t.y] - mesh.positions[t.x],
                           mesh.positions[t.z] - mesh.positions[t.x]));
}

void ExpectNear(Vec3f a, Vec3f b, float tolerance = 1e-5f) {
    EXPECT_NEAR(a.x, b.x, tolerance);
    EXPECT_NEAR(a.y, b.y, tolerance);
    EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(PbrtShapes, SphereHasItsSizeAndLooksOutwards) {
    const Mesh mesh = InWorld(LoadShape("Translate 1 2 3 Shape \"sphere\" \"float radius\" 2"));
    Mesh centered = mesh;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        const Vec3f r = mesh.positions[i] - Vec3f{1, 2, 3};
        EXPECT_NEAR(Length(r), 2, 1e-5f);
        ExpectNear(mesh.normals[i], Normalize(r));
        centered.positions[i] = r;
    }
    // Facets cut off up to the bound that the header states, 0.0006 of the radius.
    EXPECT_NEAR(Area(mesh) / (16 * M_PI), 1, 1.5e-3);
    EXPECT_NEAR(Volume(centered) / (32 * M_PI / 3), 1, 2e-3);
    for (const Vec3u& t : centered.triangles) {
        const Vec3f middle =
            (centered.positions[t.x] + centered.positions[t.y] + centered.positions[t.z]) / 3;
        EXPECT_GT(Length(middle), 2 * (1 - 0.0006f) - 1e-5f);
    }
}

TEST(PbrtShapes, PartialSphere) {
    const Mesh mesh = InWorld(
        LoadShape("Shape \"sphere\" \"float zmin\" 0 \"float zmax\" .5 \"float phimax\" 90"));
    EXPECT_NEAR(Area(mesh), M_PI / 4, 1e-3);  // a quarter of the zone 2 pi r h
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        const Vec3f p = mesh.positions[i];
        EXPECT_GE(p.z, -1e-6f);
        EXPECT_LE(p.z, 0.5f + 1e-6f);
        EXPECT_GE(p.x, -1e-6f);
        EXPECT_GE(p.y, -1e-6f);
        // u with phi; v up from zmin, ours down.
        EXPECT_NEAR(mesh.uvs[i].x, std::atan2(p.y, p.x) / (kPi / 2), 1e-4f);
        EXPECT_NEAR(1 - mesh.uvs[i].y, (kPi / 2 - std::acos(p.z)) / (kPi / 6), 1e-4f);
    }
}

TEST(PbrtShapes, DiskHasTheTrueAreaAndLooksUp) {
    const Mesh mesh = InWorld(LoadShape("Shape \"disk\" \"float radius\" 3 \"float height\" 2"));
    EXPECT_NEAR(Area(mesh), 9 * M_PI, 1e-4);
    ExpectNear(Front(mesh), {0, 0, 1});
    EXPECT_NEAR(mesh.positions[0].z, 2, 1e-6f);
    const Mesh ring = InWorld(LoadShape(
        "Shape \"disk\" \"float radius\" 3 \"float innerradius\" 1 \"float phimax\" 180"));
    EXPECT_NEAR(Area(ring), 4 * M_PI, 1e-4);
}

TEST(PbrtShapes, CylinderLooksOutwards) {
    const Mesh mesh = InWorld(
        LoadShape("Shape \"cylinder\" \"float radius\" 2 \"float zmin\" 1 \"float zmax\" 4"));
    EXPECT_NEAR(Area(mesh) / (12 * M_PI), 1, 2e-4);
    for (const Vec3u& t : mesh.triangles) {
        const Vec3f p = mesh.positions[t.x];
        const Vec3f n = Cross(mesh.positions[t.y] - p, mesh.positions[t.z] - p);
        EXPECT_GT(n.x * p.x + n.y * p.y, 0);
    }
}

TEST(PbrtShapes, FrontIsPbrtsSideOfTheNormal) {
    const std::string disk = "Shape \"disk\"";
    ExpectNear(Front(InWorld(LoadShape("ReverseOrientation " + disk))), {0, 0, -1});
    // A mirror keeps the image of the front: along the axis it turns, across it stays.
    ExpectNear(Front(InWorld(LoadShape("Scale 1 1 -1 " + disk))), {0, 0, -1});
    ExpectNear(Front(InWorld(LoadShape("Scale -1 1 1 " + disk))), {0, 0, 1});
    ExpectNear(Front(InWorld(LoadShape(kPbrtTriangle))), {0, 0, 1});
    ExpectNear(Front(InWorld(LoadShape(std::string("Scale -1 1 1 ") + kPbrtTriangle))), {0, 0, 1});
    // Normals decide against the winding.
    const std::string with_normals =
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0] "
        "\"normal N\" "
        "[0 0 -1 0 0 -1 0 0 -1]";
    const Mesh mesh = InWorld(LoadShape(with_normals));
    ExpectNear(Front(mesh), {0, 0, -1});
    ExpectNear(mesh.normals[0], {0, 0, -1});
    const Mesh turned = InWorld(LoadShape("ReverseOrientation " + with_normals));
    ExpectNear(Front(turned), {0, 0, 1});
    ExpectNear(turned.normals[0], {0, 0, 1});
}

TEST(PbrtShapes, TextureCoordinatesRunDown) {
    const Mesh mesh =
        LoadShape(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point3 P\" [0 0 0 1 "
            "0 0 0 1 0] \"point2 uv\" [0 0 1 0 0 .25]")
            .mesh;
    EXPECT_EQ(mesh.uvs[2].y, 0.75f);
    EXPECT_EQ(mesh.uvs[1].x, 1);
}

TEST(PbrtShapes, MeshesAreChecked) {
    const auto message = [](const std::string& params) {
        return MessageOf([&] { LoadPbrtWorld("Shape \"trianglemesh\" " + params + "\n"); });
    };
    const std::string points = "\"point P\" [0 0 0 1 0 0 0 1 0] ";
    EXPECT_THAT(message("\"integer indices\" [0 1 2]"),
                HasSubstr("scene.pbrt:3:1: trianglemesh: it has no vertices"));
    EXPECT_THAT(message(points + "\"integer indices\" [0 1 3]"), HasSubstr("index 3 of 3"));
    EXPECT_THAT(message(points + "\"integer indices\" [0 1 -1]"), HasSubstr("index -1"));
    EXPECT_THAT(message(points + "\"integer indices\" [0 1]"), HasSubstr("2 indices"));
    EXPECT_THAT(message("\"point P\" [0 0]"), HasSubstr("3 numbers a vertex"));
    EXPECT_THAT(message(points + "\"normal N\" [0 0 1]"), HasSubstr("1 normals N for 3"));
    EXPECT_THAT(message(points + "\"float uv\" [0 0]"), HasSubstr("1 texture coordinates"));
    EXPECT_THAT(MessageOf([] { LoadPbrtWorld("Shape \"sphere\" \"float radius\" 0\n"); }),
                HasSubstr("no surface"));
    EXPECT_THAT(
        MessageOf([] { LoadPbrtWorld("Shape \"plymesh\" \"string filename\" \"m.ply\"\n"); }),
        testing::AllOf(HasSubstr("scene.pbrt:3:1"), HasSubstr("m.ply")));
}

TEST(PbrtShapes, BilinearPatches) {
    const Mesh flat =
        LoadShape("Shape \"bilinearmesh\" \"point3 P\" [0 0 0 2 0 0 0 1 0 2 1 0]").mesh;
    EXPECT_EQ(flat.triangles.size(), 2u);
    ExpectNear(Front(flat), {0, 0, 1});
    EXPECT_NEAR(Area(flat), 2, 1e-6);
    const Mesh saddle =
        LoadShape(
            "Shape \"bilinearmesh\" \"integer indices\" [0 1 2 3] \"point3 P\" [0 0 "
            "0 1 0 0 0 1 0 1 1 1]")
            .mesh;
    EXPECT_EQ(saddle.triangles.size(), 128u);
    // z = u v: the area is the integral of sqrt(1 + u^2 + v^2) over the square, 1.28079.
    EXPECT_NEAR(Area(saddle), 1.28079, 3e-3);
    for (std::size_t i = 0; i < saddle.positions.size(); ++i) {
        const Vec3f p = saddle.positions[i];
        EXPECT_NEAR(p.z, p.x * p.y, 1e-6f);
        ExpectNear(saddle.normals[i], Normalize(Vec3f{-p.y, -p.x, 1}));
    }
}

TEST(PbrtShapes, LoopSubdivisionConverges) {
    const std::string octahedron =
        "Shape \"loopsubdiv\" \"integer indices\" [0 2 4 2 1 4 1 3 4 3 0 4 2 0 5 1 2 5 3 1 5 0 3 "
        "5] "
        "\"point P\" [1 0 0 -1 0 0 0 1 0 0 -1 0 0 0 1 0 0 -1] \"integer levels\" ";
    const Mesh coarse = LoadShape(octahedron + "3").mesh, fine = LoadShape(octahedron + "5").mesh;
    EXPECT_EQ(coarse.triangles.size(), 8u * 64);
    EXPECT_GT(Volume(coarse), 0);
    // Vertices lie on the limit surface, so that volumes differ by the facets alone.
    EXPECT_NEAR(Volume(coarse) / Volume(fine), 1, 0.03);
    for (std::size_t i = 0; i < fine.positions.size(); ++i) {
        EXPECT_GT(Dot(fine.normals[i], Normalize(fine.positions[i])), 0.7f);
    }
    const Scene capped = LoadPbrtWorld(octahedron + "30\n");
    EXPECT_THAT(Text(capped), HasSubstr("loopsubdiv: refined"));
}

TEST(LoopSubdivision, KeepsPlanesAndStraightBoundaries) {
    std::vector<Vec3f> positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    std::vector<Vec3u> triangles = {{0, 1, 2}, {0, 2, 3}};
    SubdivideLoop(2, &positions, &triangles);
    EXPECT_EQ(triangles.size(), 32u);
    for (const Vec3f& p : positions) {
        EXPECT_EQ(p.z, 0);
        EXPECT_GE(std::min(p.x, p.y), 0);
        EXPECT_LE(std::max(p.x, p.y), 1);
    }
}

TEST(PbrtShapes, CurvesAreTubesAndRibbons) {
    const std::string line = "\"point P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"float width\" .2";
    const Mesh tube = LoadShape("Shape \"curve\" \"string type\" \"cylinder\" " + line).mesh;
    // The circumference of a pentagon in a circle of radius 0.1, times 3.
    EXPECT_NEAR(Area(tube), 3 * 5 * 2 * 0.1 * std::sin(M_PI / 5), 1e-4);
    for (const Vec3u& t : tube.triangles) {
        const Vec3f p = tube.positions[t.x];
        const Vec3f n = Cross(tube.positions[t.y] - p, tube.positions[t.z] - p);
        EXPECT_GT(Dot(n, tube.normals[t.x]), 0);
        EXPECT_GT(Dot(tube.normals[t.x], {0, p.y, p.z}), 0);
    }
    const Mesh ribbon =
        LoadShape("Shape \"curve\" \"string type\" \"ribbon\" \"normal N\" [0 0 1 0 0 1] " + line)
            .mesh;
    EXPECT_NEAR(Area(ribbon), 0.6, 1e-5);
    ExpectNear(Front(ribbon), {0, 0, 1});
    const Scene hair =
        LoadPbrtWorld("Shape \"curve\" " + line + "\nShape \"curve\" " + line + "\n");
    EXPECT_EQ(hair.meshes.size(), 2u);  // one of hair, one triangle
    EXPECT_THAT(Text(hair), HasSubstr("flat curves"));
}

TEST(PbrtShapes, BSplineCurvesPassWhereTheyShould) {
    const Mesh mesh =
        LoadShape(
            "Shape \"curve\" \"string type\" \"cylinder\" \"string basis\" \"bspline\" \"point P\" "
            "[0 0 0 6 0 0 12 0 0 18 0 0] \"float width\" .1")
            .mesh;
    Box3f box;
    for (const Vec3f& p : mesh.positions) {
        box.Add(p);
    }
    EXPECT_NEAR(box.lower.x, 6, 1e-4f);  // uniform cubic: from the second to the third point
    EXPECT_NEAR(box.upper.x, 12, 1e-4f);
}

TEST(PbrtShapes, ShapesWithoutTrianglesAreLeftOutAndSaid) {
    PbrtFiles files;
    files["m.ply"] =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty "
        "float "
        "z\nend_header\n0 0 0\n";
    const Scene scene = LoadPbrtWorld("Shape \"plymesh\" \"string filename\" \"m.ply\"\n", files);
    EXPECT_EQ(scene.meshes.size(), 1u);
    EXPECT_THAT(Text(scene), HasSubstr("scene.pbrt:3: shapes without triangles"));
}

}  // namespace
}  // namespace relume::test
