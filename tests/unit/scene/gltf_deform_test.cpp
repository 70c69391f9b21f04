#include <cmath>

#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::IsEmpty;

void ExpectNear(Vec3f a, Vec3f b, float tolerance = 1e-5f) {
    EXPECT_LT(Length(a - b), tolerance) << a.x << " " << a.y << " " << a.z;
}

Scene At(const GltfFile& file, float time, float shutter = 0) {
    LoadOptions options;
    options.decode_images = false;
    options.time = time;
    options.shutter = shutter;
    return Load(file.Files(), options);
}

void Animate(GltfFile* file, int node, const char* path, const std::vector<float>& values,
             const char* type) {
    const int input = file->AddFloats({0, 1}, "SCALAR"), output = file->AddFloats(values, type);
    file->Add("animations",
              {{"samplers", json::array({{{"input", input}, {"output", output}}})},
               {"channels",
                json::array({{{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}})}});
}

json& Primitive(GltfFile* file) { return file->json["meshes"][0]["primitives"][0]; }

// The triangle with two morph targets: one lifts vertex 1 by (0, 0, 2), one moves all by (0, 4, 0)
// and tilts the normals, which look along z, to y.
GltfFile Morphed() {
    GltfFile file = TriangleFile();
    Primitive(&file)["attributes"]["NORMAL"] = file.AddFloats({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
    Primitive(&file)["targets"] = {
        {{"POSITION", file.AddFloats({0, 0, 0, 0, 0, 2, 0, 0, 0}, "VEC3")}},
        {{"POSITION", file.AddFloats({0, 4, 0, 0, 4, 0, 0, 4, 0}, "VEC3")},
         {"NORMAL", file.AddFloats({0, 1, 0, 0, 1, 0, 0, 1, 0}, "VEC3")}}};
    return file;
}

TEST(GltfMorph, WeightsOfMeshNodeAndAnimation) {
    GltfFile file = Morphed();
    ExpectNear(At(file, 0).meshes[0].positions[1], {1, 0, 0});  // none: 0
    file.json["meshes"][0]["weights"] = {0.5, 0};
    ExpectNear(At(file, 0).meshes[0].positions[1], {1, 0, 1});
    file.json["nodes"][0]["weights"] = {0, 1};
    const Scene moved = At(file, 0);
    ExpectNear(moved.meshes[0].positions[1], {1, 4, 0});
    ExpectNear(moved.meshes[0].normals[1], Normalize({0, 1, 1}));
    Animate(&file, 0, "weights", {0, 0, 1, 0.5f}, "SCALAR");
    ExpectNear(At(file, 0.5f).meshes[0].positions[1], {1, 1, 1});
    EXPECT_THAT(At(file, 0.5f).notes, IsEmpty());
}

TEST(GltfMorph, EachUseHasItsShape) {
    GltfFile file = Morphed();
    file.AddNode({{"mesh", 0}, {"weights", {1, 0}}, {"translation", {5, 0, 0}}});
    const Scene scene = At(file, 0);
    ASSERT_EQ(scene.meshes.size(), 2u);
    ExpectNear(scene.meshes[0].positions[1], {1, 0, 0});
    ExpectNear(scene.meshes[1].positions[1], {1, 0, 2});
    EXPECT_EQ(scene.instances[1].mesh, 1);
    ExpectNear(scene.instances[1].to_world.Point({0, 0, 0}), {5, 0, 0});
}

TEST(GltfMorph, MovesWhileTheShutterIsOpen) {
    GltfFile file = Morphed();
    Animate(&file, 0, "weights", {0, 0, 1, 0}, "SCALAR");
    const Scene scene = At(file, 0.25f, 0.5f);
    const Mesh& mesh = scene.meshes[0];
    ASSERT_EQ(mesh.motion.size(), 2u);
    EXPECT_EQ(mesh.motion[0], mesh.positions);
    ExpectNear(mesh.positions[1], {1, 0, 0.5f});
    ExpectNear(mesh.motion[1][1], {1, 0, 1.5f});
    EXPECT_THAT(scene.instances[0].motion, IsEmpty());
    EXPECT_THAT(At(file, 0.25f).meshes[0].motion, IsEmpty());
}

// The triangle hangs on two joints: vertex 0 on the first, 1 on the second, 2 on both. Nodes: 0 has
// the mesh, 1 and 2 are the joints; the second is bound at (1, 0, 0).
GltfFile Skinned() {
    GltfFile file = TriangleFile();
    json& attributes = Primitive(&file)["attributes"];
    attributes["NORMAL"] = file.AddFloats({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
    attributes["JOINTS_0"] = file.AddAccessor(
        Bytes<std::uint8_t>({0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}), kUByte, "VEC4", 3);
    attributes["WEIGHTS_0"] = file.AddFloats({1, 0, 0, 0, 1, 0, 0, 0, 0.5f, 0.5f, 0, 0}, "VEC4");
    file.AddNode({{"translation", {0, 0, 0}}});
    file.AddNode({{"translation", {1, 0, 0}}});
    const int bind =
        file.AddAccessor(Bytes<float>({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0,  0, 0, 1,
                                       1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1}),
                         kFloat, "MAT4", 2);
    file.Add("skins", {{"joints", {1, 2}}, {"inverseBindMatrices", bind}});
    file.json["nodes"][0]["skin"] = 0;
    file.json["nodes"][0]["translation"] = {50, 50, 50};  // without effect
    return file;
}

TEST(GltfSkin, PosesTheMeshInTheWorld) {
    GltfFile file = Skinned();
    const Scene bound = At(file, 0);
    EXPECT_THAT(bound.notes, IsEmpty());
    EXPECT_EQ(bound.instances[0].to_world, Transform());
    ExpectNear(bound.meshes[0].positions[1], {1, 0, 0});
    ExpectNear(bound.meshes[0].positions[2], {0, 1, 0});
    // The second joint turns by 90 degrees about z (x to y) and goes to (1, 0, 3).
    const float s = std::sqrt(0.5f);
    file.json["nodes"][2] = {{"translation", {1, 0, 3}}, {"rotation", {0, 0, s, s}}};
    const Scene posed = At(file, 0);
    ExpectNear(posed.meshes[0].positions[0], {0, 0, 0});
    ExpectNear(posed.meshes[0].positions[1], {1, 0, 3});
    // (0, 1, 0) is (-1, 1, 0) to the second joint: there it goes to (-1, -1, 0) + (1, 0, 3).
    ExpectNear(posed.meshes[0].positions[2], {0, 0, 1.5f});
    ExpectNear(posed.meshes[0].normals[2], {0, 0, 1});
}

TEST(GltfSkin, DeformsWhileTheShutterIsOpen) {
    GltfFile file = Skinned();
    Animate(&file, 2, "translation", {1, 0, 0, 1, 0, 8}, "VEC3");
    const Scene scene = At(file, 0.25f, 0.5f);
    ASSERT_EQ(scene.meshes[0].motion.size(), 2u);
    ExpectNear(scene.meshes[0].positions[1], {1, 0, 2});
    ExpectNear(scene.meshes[0].motion[1][1], {1, 0, 6});
    ExpectNear(scene.meshes[0].motion[1][2], {0, 1, 3});
    ExpectNear(scene.meshes[0].motion[1][0], {0, 0, 0});
}

TEST(GltfSkin, FaultsAreNamed) {
    const auto message = [](auto&& change) {
        GltfFile file = Skinned();
        change(&file);
        return MessageOf([&] { At(file, 0); });
    };
    EXPECT_THAT(message([](GltfFile* f) { f->json["nodes"][0]["skin"] = 4; }),
                HasSubstr("node 0: skin 4 does not exist"));
    EXPECT_THAT(message([](GltfFile* f) {
                    f->json["skins"][0]["joints"] = {1, 9};
                }),
                HasSubstr("skin 0: its joint, node 9, is not in the scene"));
    EXPECT_THAT(message([](GltfFile* f) { f->json["skins"][0]["joints"] = {1}; }),
                HasSubstr("mesh 0, primitive 0: vertex 1 hangs on joint 1 of 1"));
    EXPECT_THAT(message([](GltfFile* f) { Primitive(f)["attributes"].erase("WEIGHTS_0"); }),
                HasSubstr("has no JOINTS_0 and WEIGHTS_0"));
    EXPECT_THAT(message([](GltfFile* f) {
                    Primitive(f)["attributes"]["WEIGHTS_0"] =
                        f->AddFloats({1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
                }),
                HasSubstr("vertex 1 hangs on no joint"));
    EXPECT_THAT(message([](GltfFile* f) {
                    f->json["skins"][0]["joints"] = {1, 2, 1};
                }),
                HasSubstr("2 inverse bind matrices for 3 joints"));
    GltfFile morphed = Morphed();
    morphed.json["nodes"][0]["weights"] = {1, 2, 3};
    EXPECT_THAT(MessageOf([&] { At(morphed, 0); }), HasSubstr("3 weights for 2 morph targets"));
}

}  // namespace
}  // namespace relume::test
