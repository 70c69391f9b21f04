#include <cmath>

#include "core/scene/polygon.h"
#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

Scene LoadText(const std::string& text, std::map<std::string, std::string> more = {}) {
    MapSource files;
    files.files = std::move(more);
    files.files["a.obj"] = text;
    return LoadScene(files, "a.obj", {.decode_images = false});
}

std::string Problem(const std::string& text, std::map<std::string, std::string> more = {}) {
    return MessageOf([&] { LoadText(text, std::move(more)); });
}

TEST(Obj, ATriangle) {
    const Scene scene = LoadText(std::string(kTriangle) +
                                 "vt 0 0\nvt 1 0\nvt 0 0.25\n# comment\nvn 0 0 2\n"
                                 "f 1/1/1 2/2/1 \\\n 3/3/1 # and more\r\n");
    ASSERT_EQ(scene.meshes.size(), 1u);
    const Mesh& mesh = scene.meshes[0];
    ASSERT_EQ(mesh.positions.size(), 3u);
    ASSERT_EQ(mesh.triangles.size(), 1u);
    EXPECT_EQ(mesh.positions[1], (Vec3f{1, 0, 0}));
    EXPECT_EQ(mesh.normals.at(0), (Vec3f{0, 0, 1}));
    EXPECT_EQ(mesh.uvs.at(0).y, 1);  // v runs down
    EXPECT_EQ(mesh.uvs.at(2).y, 0.75f);
    EXPECT_EQ(mesh.source, "a.obj:9:1");
    EXPECT_EQ(scene.instances.size(), 1u);
    EXPECT_EQ(scene.materials.at(0).type, "diffuse");
    EXPECT_THAT(scene.notes, IsEmpty());
    EXPECT_THAT(scene.cameras, IsEmpty());
}

TEST(Obj, IndicesCountBackFromTheLast) {
    const Scene scene =
        LoadText(std::string(kTriangle) + "v 5 5 5\nf -4 -3 -2\nv 9 9 9\nf 1 2 -1\n");
    EXPECT_EQ(scene.meshes[0].triangles.size(), 2u);
    EXPECT_EQ(scene.meshes[0].positions[scene.meshes[0].triangles[0].z], (Vec3f{0, 1, 0}));
    EXPECT_EQ(scene.meshes[0].positions[scene.meshes[0].triangles[1].z], (Vec3f{9, 9, 9}));
}

TEST(Obj, GroupsAndMaterialsAreMeshesInTheirOrder) {
    const std::string quad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    const Scene scene = LoadText(
        quad +
            "mtllib a.mtl\no house\ng wall\nusemtl red\nf 1 2 3\ng roof\nusemtl blue\nf 1 3 4\n"
            "g wall\nusemtl red\nf 2 3 4\nusemtl blue\nf 1 2 4\n",
        {{"a.mtl", "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n"}});
    ASSERT_EQ(scene.meshes.size(), 3u);
    EXPECT_EQ(scene.meshes[0].name, "house wall");
    EXPECT_EQ(scene.meshes[0].triangles.size(), 2u);
    EXPECT_EQ(scene.meshes[1].name, "house roof");
    EXPECT_EQ(scene.meshes[2].name, "house wall");
    const auto material = [&](std::size_t mesh) {
        return scene.materials.at(static_cast<std::size_t>(scene.meshes[mesh].material)).name;
    };
    EXPECT_EQ(material(0), "red");
    EXPECT_EQ(material(1), "blue");
    EXPECT_EQ(material(2), "blue");
    EXPECT_THAT(scene.notes, IsEmpty());
}

TEST(Obj, SmoothingGroupsShareNormals) {
    // Two faces of a roof along z; in a group their common edge has the normal between theirs.
    const std::string roof = "v -1 0 0\nv 0 1 0\nv 0 1 1\nv -1 0 1\nv 1 0 0\nv 1 0 1\n";
    const std::string faces = "f 1 4 3 2\nf 2 3 6 5\n";
    EXPECT_THAT(LoadText(roof + faces).meshes[0].normals, IsEmpty());
    const Mesh smooth = LoadText(roof + "s 1\n" + faces).meshes[0];
    ASSERT_EQ(smooth.normals.size(), 6u);  // corners are shared
    for (std::size_t i = 0; i < 6; ++i) {
        const Vec3f expected =
            smooth.positions[i].x < 0   ? Vec3f{-std::sqrt(0.5f), std::sqrt(0.5f), 0}
            : smooth.positions[i].x > 0 ? Vec3f{std::sqrt(0.5f), std::sqrt(0.5f), 0}
                                        : Vec3f{0, 1, 0};
        EXPECT_NEAR(Length(smooth.normals[i] - expected), 0, 1e-6f) << i;
    }
    // Different groups share nothing; off again is flat beside them.
    const Mesh apart = LoadText(roof + "s 1\nf 1 4 3 2\ns 2\nf 2 3 6 5\n").meshes[0];
    EXPECT_EQ(apart.positions.size(), 8u);
    const Mesh flat = LoadText(roof + "s 1\nf 1 4 3 2\ns off\nf 2 3 6 5\n").meshes[0];
    EXPECT_EQ(flat.positions.size(), 8u);
    EXPECT_NEAR(flat.normals.back().x, std::sqrt(0.5f), 1e-6f);
}

double AreaOf(const std::vector<Vec3f>& corners, const std::vector<Vec3u>& triangles) {
    double area = 0;
    for (const Vec3u& t : triangles) {
        area += 0.5 * Cross(corners[t.y] - corners[t.x], corners[t.z] - corners[t.x]).z;
    }
    return area;
}

TEST(Obj, ConcavePolygonsAreCutInside) {
    // A star of 5 points: fans would leave it. All triangles turn as it does.
    std::vector<Vec3f> star;
    for (int i = 0; i < 10; ++i) {
        const float angle = static_cast<float>(i) * kPi / 5;
        const float r = i % 2 == 0 ? 1.0f : 0.3f;
        star.push_back({r * std::cos(angle), r * std::sin(angle), 2});
    }
    for (std::size_t first = 0; first < star.size(); ++first) {
        std::vector<Vec3u> triangles;
        Triangulate(star, &triangles);
        ASSERT_EQ(triangles.size(), 8u);
        for (const Vec3u& t : triangles) {
            EXPECT_GT(AreaOf(star, {t}), 0);
        }
        // 10 triangles of the centre, of sides 1 and 0.3 with a tenth of a turn between.
        EXPECT_NEAR(AreaOf(star, triangles), 10 * 0.5 * 0.3 * std::sin(kPi / 5), 1e-6);
        std::rotate(star.begin(), star.begin() + 1, star.end());
    }
    std::reverse(star.begin(), star.end());
    std::vector<Vec3u> turned;
    Triangulate(star, &turned);
    EXPECT_NEAR(AreaOf(star, turned), -10 * 0.5 * 0.3 * std::sin(kPi / 5), 1e-6);
}

TEST(Obj, WhatIsLeftOutIsNotedOnceWithItsPlace) {
    const Scene scene = LoadText(std::string(kTriangle) +
                                 "v 1 1 1 0.5 0.5 0.5\nl 1 2\nl 2 3\np 1\ncurv 0 1 1 2\nf 1 2 3\n"
                                 "f 1 2 2\nlod 3\n");
    EXPECT_THAT(scene.notes,
                ElementsAre("a.obj:4: vertex colours are ignored",
                            "a.obj:5: points and lines are left out: they have no surface",
                            "a.obj:8: 'curv' is not supported, and ignored"));
    EXPECT_EQ(scene.TriangleCount(), 1u);  // and the one without an area
}

TEST(Obj, BadLinesAreToldByFileLineAndRemedy) {
    const std::string t = kTriangle;
    EXPECT_THAT(Problem("v 0 0 0\nv nan 0 0\n"),
                AllOf(HasSubstr("a.obj:2:3"), HasSubstr("not finite"), HasSubstr("export")));
    EXPECT_THAT(Problem("v 1e99 0 0\n"), HasSubstr("not finite"));
    EXPECT_THAT(Problem("v 0 zero 0\n"), HasSubstr("a.obj:1:5: expected a number, found 'zero'"));
    EXPECT_THAT(Problem("v 0 0\n"), HasSubstr("a.obj:1:1: 'v' needs 3 numbers, found 2"));
    EXPECT_THAT(Problem(t + "f 1 2 0\n"), HasSubstr("a.obj:4:7: index 0"));
    EXPECT_THAT(Problem(t + "f 1 2 -4\n"), HasSubstr("a.obj:4:7: index -4"));
    EXPECT_THAT(Problem(t + "f 1 2 3\nf 1 2 4\n"),
                AllOf(HasSubstr("a.obj:5:7: index 4 refers to no 'v'"), HasSubstr("has 3")));
    EXPECT_THAT(Problem(t + "f 1/1 2 3\n"), HasSubstr("a.obj:4:3: index 1 refers to no 'vt'"));
    EXPECT_THAT(Problem(t + "f 1//1 2 3\n"), HasSubstr("refers to no 'vn'"));
    EXPECT_THAT(Problem(t + "f 1 2 3/4/5/6\n"), HasSubstr("v/vt/vn"));
    EXPECT_THAT(Problem(t + "f 1 2 x\n"), HasSubstr("v/vt/vn"));
    EXPECT_THAT(Problem(t + "f 1 2 99999999999\n"), HasSubstr("v/vt/vn"));
    EXPECT_THAT(Problem(t + "f 1 2\n"), HasSubstr("a.obj:4:1: a face needs 3 corners"));
    EXPECT_THAT(Problem(""), HasSubstr("no triangles"));
    EXPECT_THAT(Problem(t + "mtllib ../a.mtl\nf 1 2 3\n"), HasSubstr("stay below"));
    // A later vertex is there in time.
    EXPECT_EQ(LoadText("f 1 2 3\n" + t).TriangleCount(), 1u);
}

TEST(Obj, MissingLibrariesAndMaterialsAreNoted) {
    const Scene scene = LoadText(std::string(kTriangle) + "mtllib gone.mtl\nusemtl red\nf 1 2 3\n");
    EXPECT_THAT(scene.notes,
                ElementsAre(AllOf(HasSubstr("a.obj:4: the material library 'gone.mtl' is missing"),
                                  HasSubstr("restore")),
                            "a.obj:5: the material 'red' is in no library: the default is used"));
    EXPECT_EQ(scene.materials.at(static_cast<std::size_t>(scene.meshes[0].material)).name,
              "default");
}

TEST(Obj, FilesAreListedWithLibrariesAndPictures) {
    MapSource files;
    files.files["a.obj"] = std::string(kTriangle) +
                           "mtllib look/my lib.mtl\nmtllib x.mtl look/y.mtl\nusemtl m\nf 1 2 3\n";
    files.files["look/my lib.mtl"] =
        "newmtl m\nmap_Kd tex\\a b.tga\nmap_Ks -s 2 2 ../c.tga\nnewmtl unused\nmap_Kd no.tga\n";
    files.files["look/y.mtl"] = "";
    EXPECT_THAT(ListSceneFiles(files, "a.obj"),
                ElementsAre("a.obj", "look/my lib.mtl", "look/y.mtl", "look/tex/a b.tga", "c.tga"));
    EXPECT_THAT(MessageOf([&] { LoadScene(files, "a.obj", {}); }),
                AllOf(HasSubstr("look/my lib.mtl:2:1: map_Kd"), HasSubstr("look/tex/a b.tga"),
                      HasSubstr("restore")));
    files.files["look/tex/a b.tga"] = TgaPicture(1, 1, 1, 2, 3);
    files.files["c.tga"] = TgaPicture(1, 1, 1, 2, 3);
    const Scene scene = LoadScene(files, "a.obj", {});
    EXPECT_THAT(scene.notes, Contains(HasSubstr("'x.mtl' is missing")));
    EXPECT_THAT(scene.notes, Contains(HasSubstr("has no texture coordinates")));
}

}  // namespace
}  // namespace relume::test
