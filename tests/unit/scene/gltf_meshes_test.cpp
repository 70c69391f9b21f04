#include <cmath>
#include <limits>

#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kPoints = 0, kStrip = 5, kFan = 6;

// A fan about (0,0,0), and as a strip: vertices 0 1 2 3 4.
const std::vector<float> kFive{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, -1, 1, 0};

std::vector<std::vector<std::uint32_t>> Triangles(int mode,
                                                  const std::vector<std::uint16_t>& indices) {
    GltfFile file;
    const int positions = file.AddFloats(kFive, "VEC3");
    const int index_accessor = indices.empty() ? -1
                                               : file.AddAccessor(Bytes(indices), kUShort, "SCALAR",
                                                                  static_cast<int>(indices.size()));
    file.AddNode(
        {{"mesh", file.AddMesh({{"POSITION", positions}}, index_accessor, {{"mode", mode}})}});
    std::vector<std::vector<std::uint32_t>> out;
    const Scene scene = Load(file);
    for (const Vec3u& t : scene.meshes.at(0).triangles) {
        out.push_back({t.x, t.y, t.z});
    }
    return out;
}

std::vector<std::uint32_t> T(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    return {a, b, c};
}

TEST(GltfMeshes, StripsTurnEveryOtherTriangle) {
    EXPECT_THAT(Triangles(kStrip, {}), ElementsAre(T(0, 1, 2), T(1, 3, 2), T(2, 3, 4)));
    EXPECT_THAT(Triangles(kStrip, {4, 3, 2, 1}), ElementsAre(T(4, 3, 2), T(3, 1, 2)));
}

TEST(GltfMeshes, StitchesOfStripsAreDropped) {
    EXPECT_THAT(Triangles(kStrip, {0, 1, 2, 2, 2, 3, 4}), ElementsAre(T(0, 1, 2), T(2, 3, 4)));
}

TEST(GltfMeshes, FansTurnAboutTheirFirstVertex) {
    EXPECT_THAT(Triangles(kFan, {}), ElementsAre(T(1, 2, 0), T(2, 3, 0), T(3, 4, 0)));
    EXPECT_THAT(Triangles(kFan, {1, 2, 4}), ElementsAre(T(2, 4, 1)));
}

TEST(GltfMeshes, PrimitivesBecomeMeshesWithTheirMaterials) {
    GltfFile file = TexturedFile({{"name", "first"}});
    json second = file.json["meshes"][0]["primitives"][0];
    second["material"] = file.Add("materials", {{"name", "unused"}}) + 1;
    file.Add("materials", {{"name", "third"}});
    file.json["meshes"][0]["primitives"].push_back(second);
    file.json["meshes"][0]["name"] = "body";
    const Scene scene = Load(file);
    ASSERT_EQ(scene.meshes.size(), 2u);
    EXPECT_EQ(scene.instances.size(), 2u);
    EXPECT_EQ(scene.materials.size(), 2u);
    EXPECT_EQ(scene.materials.at(static_cast<std::size_t>(scene.meshes[0].material)).name, "first");
    EXPECT_EQ(scene.materials.at(static_cast<std::size_t>(scene.meshes[1].material)).name, "third");
    EXPECT_EQ(scene.meshes[1].name, "body");
    EXPECT_EQ(scene.meshes[1].source, "scene.gltf: mesh 0 'body', primitive 1");
}

// With normals, uvs and tangents, and a material that has a normal map or not.
GltfFile Complete(bool normal_map, const std::vector<float>& normals,
                  const std::vector<float>& tangents) {
    GltfFile file = TexturedFile(normal_map ? json{{"normalTexture", {{"index", 0}}}}
                                            : json{{"name", "plain"}});
    file.Add("textures", {{"source", 0}});
    file.Add("images", {{"uri", "data:," + std::string("%00%00%02%00%00%00%00%00%00%00%00%00%01%00"
                                                       "%01%00%18%00%00%00%00")}});
    json& attributes = file.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["NORMAL"] = file.AddFloats(normals, "VEC3");
    attributes["TANGENT"] = file.AddFloats(tangents, "VEC4");
    return file;
}

const std::vector<float> kNormals{0, 0, 2, 0, 0, 1, 0, 0.6f, 0.8f};
const std::vector<float> kTangents{2, 0, 0, 1, 1, 0, 0, -1, 0, 1, 0, 1};

TEST(GltfMeshes, AttributesAreReadAndNormalised) {
    const Mesh mesh = Load(Complete(true, kNormals, kTangents)).meshes.at(0);
    EXPECT_THAT(mesh.normals, ElementsAre(Vec3f{0, 0, 1}, Vec3f{0, 0, 1}, Vec3f{0, 0.6f, 0.8f}));
    EXPECT_THAT(mesh.tangents, ElementsAre(Vec3f{1, 0, 0}, Vec3f{1, 0, 0}, Vec3f{0, 1, 0}));
    EXPECT_THAT(mesh.tangent_signs, ElementsAre(1, -1, 1));
    ASSERT_EQ(mesh.uvs.size(), 3u);
    EXPECT_EQ(mesh.uvs[1].x, 1);
    EXPECT_EQ(mesh.uvs[2].y, 1);
}

TEST(GltfMeshes, WhatTheMaterialDoesNotLookAtIsNotKept) {
    const Mesh mesh = Load(Complete(false, kNormals, kTangents)).meshes.at(0);
    EXPECT_EQ(mesh.normals.size(), 3u);
    EXPECT_THAT(mesh.uvs, IsEmpty());
    EXPECT_THAT(mesh.tangents, IsEmpty());
}

TEST(GltfMeshes, NormalsOfLengthZeroAreReplacedAndSaid) {
    const Scene scene = Load(Complete(true, {0, 0, 0, 0, 1, 0, 0, 0, 0}, kTangents));
    EXPECT_THAT(scene.meshes.at(0).normals,
                ElementsAre(Vec3f{0, 0, 1}, Vec3f{0, 1, 0}, Vec3f{0, 0, 1}));
    EXPECT_THAT(scene.notes, ElementsAre(HasSubstr("scene.gltf: mesh 0, primitive 0: normals")));
}

TEST(GltfMeshes, TangentsOfNoDirectionAreLeftToTheRenderer) {
    const Scene scene = Load(Complete(true, kNormals, {0, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}));
    EXPECT_THAT(scene.meshes.at(0).tangents, IsEmpty());
    EXPECT_THAT(scene.meshes.at(0).tangent_signs, IsEmpty());
    EXPECT_THAT(scene.notes, Contains(HasSubstr("tangents")));
}

TEST(GltfMeshes, WhatIsLeftOutIsSaidOnce) {
    GltfFile file = TriangleFile();
    json points = file.json["meshes"][0]["primitives"][0];
    points["mode"] = kPoints;
    file.json["meshes"][0]["primitives"].push_back(points);
    file.json["meshes"][0]["primitives"].push_back(points);
    json& triangle = file.json["meshes"][0]["primitives"][0];
    triangle["attributes"]["COLOR_0"] = 0;
    file.json["extensionsUsed"] = {"KHR_materials_unheard_of", "KHR_materials_ior"};
    const Scene scene = Load(file);
    EXPECT_EQ(scene.TriangleCount(), 1u);
    EXPECT_THAT(scene.notes,
                testing::UnorderedElementsAre(HasSubstr("points and lines"), HasSubstr("COLOR_0"),
                                              HasSubstr("KHR_materials_unheard_of")));
}

TEST(GltfMeshes, TexturesWithoutCoordinatesAreSaid) {
    GltfFile file = Complete(true, kNormals, kTangents);
    file.json["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_0");
    EXPECT_THAT(Load(file).notes, Contains(HasSubstr("mesh 0, primitive 0: has no TEXCOORD_0")));
}

TEST(GltfMeshes, EachKindOfNotFiniteVertexIsRefused) {
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        GltfFile file;
        const int positions = file.AddFloats({0, 0, 0, 1, 0, 0, 0, bad, 0}, "VEC3");
        file.AddNode({{"mesh", file.AddMesh({{"POSITION", positions}})}});
        file.json["meshes"][0]["name"] = "wall";
        EXPECT_THAT(MessageOf([&] { Load(file); }),
                    AllOf(HasSubstr("scene.gltf: mesh 0 'wall', primitive 0: vertex 2"),
                          HasSubstr("repair")));
        EXPECT_THAT(MessageOf([&] {
                        Load(Complete(true, {0, 0, 1, 0, 0, bad, 0, 0, 1}, kTangents));
                    }),
                    HasSubstr("normal of vertex 1"));
    }
}

TEST(GltfMeshes, EmptyMeshesAreRefused) {
    const auto message = [](const std::vector<float>& positions) {
        GltfFile file;
        file.AddView("so that there is a buffer");
        file.AddNode({{"mesh", file.AddMesh({{"POSITION", file.AddFloats(positions, "VEC3")}})}});
        return MessageOf([&] { Load(file); });
    };
    const auto empty = AllOf(HasSubstr("scene.gltf: mesh 0, primitive 0"), HasSubstr("empty"));
    EXPECT_THAT(message({}), empty);
    EXPECT_THAT(message({1, 1, 1, 1, 1, 1, 1, 1, 1}), empty);
    EXPECT_THAT(message({0, 0, 0, 1, 1, 1, 2, 2, 2}), empty);
    GltfFile file = TriangleFile();
    file.json["meshes"][0]["primitives"] = json::array();
    EXPECT_THAT(MessageOf([&] { Load(file); }),
                AllOf(HasSubstr("scene.gltf: mesh 0"), HasSubstr("empty")));
}

TEST(GltfMeshes, WrongIndicesAndCountsAreRefused) {
    GltfFile file = TriangleFile();
    json& primitive = file.json["meshes"][0]["primitives"][0];
    primitive["indices"] = file.AddAccessor(Bytes<std::uint16_t>({0, 1, 3}), kUShort, "SCALAR", 3);
    EXPECT_THAT(MessageOf([&] { Load(file); }),
                HasSubstr("scene.gltf: mesh 0, primitive 0: index 2 refers to vertex 3 of 3"));
    primitive["indices"] = file.AddAccessor(Bytes<std::uint16_t>({0, 1}), kUShort, "SCALAR", 2);
    EXPECT_THAT(MessageOf([&] { Load(file); }), HasSubstr("2 corners"));
    primitive["indices"] = file.AddFloats({0, 1, 2}, "SCALAR");
    EXPECT_THAT(MessageOf([&] { Load(file); }),
                AllOf(HasSubstr("mesh 0, primitive 0: indices"), HasSubstr("component type 5126")));
    primitive.erase("indices");
    primitive["mode"] = 9;
    EXPECT_THAT(MessageOf([&] { Load(file); }), HasSubstr("mesh 0, primitive 0: mode 9"));
}

TEST(GltfMeshes, WrongAttributesAreRefused) {
    GltfFile file = TriangleFile();
    json& attributes = file.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["NORMAL"] = file.AddFloats({0, 0, 1, 0, 0, 1}, "VEC3");
    EXPECT_THAT(MessageOf([&] { Load(file); }), HasSubstr("primitive 0: 2 normals for 3 vertices"));
    attributes["NORMAL"] = file.AddFloats({0, 0, 1, 0, 0, 1}, "VEC2");
    EXPECT_THAT(MessageOf([&] { Load(file); }),
                AllOf(HasSubstr("primitive 0: NORMAL"), HasSubstr("2 components where 3")));
    attributes["NORMAL"] = 55;
    EXPECT_THAT(MessageOf([&] { Load(file); }), HasSubstr("accessor 55 does not exist"));
    attributes.erase("NORMAL");
    attributes.erase("POSITION");
    EXPECT_THAT(MessageOf([&] { Load(file); }), HasSubstr("mesh 0, primitive 0: has no POSITION"));
}

}  // namespace
}  // namespace relume::test
