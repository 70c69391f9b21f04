#include <cmath>

#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

// Transforms are compared by what they do; single precision leaves a few units in the last place.
void ExpectNear(Vec3f a, Vec3f b) {
    EXPECT_NEAR(a.x, b.x, 1e-5f);
    EXPECT_NEAR(a.y, b.y, 1e-5f);
    EXPECT_NEAR(a.z, b.z, 1e-5f);
}

const float kHalf = std::sqrt(0.5f);

TEST(GltfNodes, ScaleThenRotationThenTranslation) {
    GltfFile file = TriangleFile();
    file.json["nodes"][0]["translation"] = {10, 20, 30};
    file.json["nodes"][0]["rotation"] = {0, 0, kHalf, kHalf};  // x to y
    file.json["nodes"][0]["scale"] = {2, 3, 4};
    const Scene scene = Load(file);
    ASSERT_EQ(scene.instances.size(), 1u);
    ExpectNear(scene.instances[0].to_world.Point({1, 0, 0}), {10, 22, 30});
    ExpectNear(scene.instances[0].to_world.Point({0, 1, 1}), {7, 20, 34});
}

TEST(GltfNodes, MatrixIsStoredByColumns) {
    GltfFile file = TriangleFile();
    file.json["nodes"][0]["matrix"] = {0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 5, 6, 7, 1};
    ExpectNear(Load(file).instances[0].to_world.Point({1, 0, 0}), {5, 8, 7});
}

TEST(GltfNodes, ChildrenInheritTheirParentsTransform) {
    GltfFile file = TriangleFile();
    file.json["nodes"][0]["translation"] = {1, 0, 0};
    const int parent = file.Add("nodes", {{"scale", {2, 2, 2}}, {"children", {0}}});
    const int grandparent = file.Add("nodes", {{"translation", {0, 5, 0}}, {"children", {parent}}});
    file.json["scenes"][0]["nodes"] = {grandparent};
    ExpectNear(Load(file).instances[0].to_world.Point({0, 0, 0}), {2, 5, 0});
}

TEST(GltfNodes, AMeshUsedTwiceIsOneMeshAndTwoInstances) {
    GltfFile file = TriangleFile();
    file.AddNode({{"mesh", 0}, {"translation", {3, 0, 0}}});
    const Scene scene = Load(file);
    EXPECT_EQ(scene.meshes.size(), 1u);
    ASSERT_EQ(scene.instances.size(), 2u);
    EXPECT_EQ(scene.TriangleCount(), 2u);
    EXPECT_EQ(scene.Bounds().upper, (Vec3f{4, 1, 0}));
    EXPECT_EQ(scene.Bounds().lower, (Vec3f{0, 0, 0}));
}

TEST(GltfNodes, OnlyTheDefaultSceneIsPlaced) {
    GltfFile file = TriangleFile();
    const int other = file.Add("nodes", {{"mesh", 0}, {"translation", {3, 0, 0}}});
    file.Add("scenes", {{"nodes", {other}}});
    file.json["scene"] = 1;
    const Scene scene = Load(file);
    ASSERT_EQ(scene.instances.size(), 1u);
    ExpectNear(scene.instances[0].to_world.Point({0, 0, 0}), {3, 0, 0});
    EXPECT_THAT(scene.notes, testing::Contains(HasSubstr("2 scenes")));
}

TEST(GltfNodes, AllRootsArePlacedWithoutAScene) {
    GltfFile file = TriangleFile();
    file.Add("nodes", {{"children", {0}}});
    file.Add("nodes", {{"mesh", 0}});
    file.json.erase("scenes");
    file.json.erase("scene");
    EXPECT_EQ(Load(file).instances.size(), 2u);
}

TEST(GltfNodes, ALongChainNeedsNoStack) {
    GltfFile file = TriangleFile();
    for (int i = 0; i < 50000; ++i) {
        file.Add("nodes", {{"children", {i}}});
    }
    file.json["scenes"][0]["nodes"] = {50000};
    EXPECT_EQ(Load(file).instances.size(), 1u);
}

TEST(GltfNodes, CycleNamesTheNode) {
    GltfFile file = TriangleFile();
    file.json["nodes"][0]["children"] = {1};
    file.json["nodes"][0]["name"] = "wheel";
    file.Add("nodes", {{"children", {0}}});
    EXPECT_THAT(MessageOf([&] { Load(file); }),
                AllOf(HasSubstr("scene.gltf: node 0 'wheel'"), HasSubstr("reached twice")));
}

TEST(GltfNodes, ScaleZeroUnderAMeshNamesTheNode) {
    GltfFile file = TriangleFile();
    file.json["nodes"][0]["scale"] = {1, 0, 1};
    EXPECT_THAT(MessageOf([&] { Load(file); }),
                AllOf(HasSubstr("scene.gltf: node 0"), HasSubstr("singular")));
}

TEST(GltfNodes, MissingMeshAndMissingChildNameWhoWantsThem) {
    GltfFile file = TriangleFile();
    file.json["nodes"][0]["mesh"] = 7;
    EXPECT_THAT(MessageOf([&] { Load(file); }), HasSubstr("scene.gltf: node 0: mesh 7"));
    file = TriangleFile();
    file.json["nodes"][0]["children"] = {9};
    EXPECT_THAT(MessageOf([&] { Load(file); }), HasSubstr("node 9"));
}

TEST(GltfCameras, PerspectiveKeepsPlaceAndAxesButNotScale) {
    GltfFile file = TriangleFile();
    const int camera = file.Add(
        "cameras", {{"type", "perspective"},
                    {"name", "eye"},
                    {"perspective", {{"yfov", 0.5}, {"aspectRatio", 1.5}, {"znear", 0.1}}}});
    file.AddNode({{"camera", camera},
                  {"translation", {1, 2, 3}},
                  {"rotation", {0, kHalf, 0, kHalf}},  // -z to -x
                  {"scale", {5, 5, 5}}});
    const Scene scene = Load(file);
    ASSERT_EQ(scene.cameras.size(), 1u);
    const Camera& eye = scene.cameras[0];
    EXPECT_EQ(eye.name, "eye");
    EXPECT_EQ(eye.type, "perspective");
    EXPECT_FLOAT_EQ(eye.params.GetFloat("yfov", 0), 0.5f);
    EXPECT_FLOAT_EQ(eye.params.GetFloat("aspect_ratio", 0), 1.5f);
    ExpectNear(eye.to_world.Point({0, 0, 0}), {1, 2, 3});
    ExpectNear(eye.to_world.Vector({0, 0, -1}), {-1, 0, 0});
    ExpectNear(eye.to_world.Vector({0, 1, 0}), {0, 1, 0});
}

TEST(GltfCameras, OrthographicAndBadAngles) {
    GltfFile file = TriangleFile();
    file.Add("cameras", {{"type", "orthographic"},
                         {"orthographic", {{"xmag", 2}, {"ymag", 3}, {"znear", 0}, {"zfar", 9}}}});
    file.AddNode({{"camera", 0}});
    const Scene scene = Load(file);
    EXPECT_FLOAT_EQ(scene.cameras.at(0).params.GetFloat("xmag", 0), 2);
    EXPECT_FLOAT_EQ(scene.cameras.at(0).params.GetFloat("ymag", 0), 3);
    file.json["cameras"][0] = {{"type", "perspective"},
                               {"perspective", {{"yfov", 4}, {"znear", 0.1}}}};
    EXPECT_THAT(MessageOf([&] { Load(file); }),
                AllOf(HasSubstr("scene.gltf: camera 0"), HasSubstr("yfov")));
}

TEST(GltfLights, AllThreeTypes) {
    GltfFile file = TriangleFile();
    file.json["extensionsUsed"] = {"KHR_lights_punctual"};
    file.json["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "point"}, {"intensity", 10}, {"color", {1, 0.5, 0}}, {"name", "bulb"}},
        {{"type", "spot"},
         {"intensity", 2},
         {"range", 9},
         {"spot", {{"innerConeAngle", 0.25}, {"outerConeAngle", 0.5}}}},
        {{"type", "directional"}, {"intensity", 3}}};
    for (int i = 0; i < 3; ++i) {
        file.AddNode({{"translation", {0, 4, 0}},
                      {"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
    }
    const Scene scene = Load(file);
    ASSERT_EQ(scene.lights.size(), 3u);
    EXPECT_EQ(scene.lights[0].type, "point");
    EXPECT_EQ(scene.lights[0].name, "bulb");
    EXPECT_EQ(scene.lights[0].params.GetFloats("intensity", {}), (std::vector<float>{10, 5, 0}));
    ExpectNear(scene.lights[0].to_world.Point({0, 0, 0}), {0, 4, 0});
    EXPECT_FLOAT_EQ(scene.lights[1].params.GetFloat("inner_angle", 0), 0.25f);
    EXPECT_FLOAT_EQ(scene.lights[1].params.GetFloat("outer_angle", 0), 0.5f);
    EXPECT_EQ(scene.lights[2].params.GetFloats("irradiance", {}), (std::vector<float>{3, 3, 3}));
    EXPECT_TRUE(scene.HasLight());
    EXPECT_THAT(scene.notes, testing::ElementsAre(HasSubstr("range")));
}

TEST(GltfLights, NegativeIntensityNamesTheLight) {
    GltfFile file = TriangleFile();
    file.json["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "point"}, {"intensity", -1}, {"name", "hole"}}};
    file.AddNode({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    EXPECT_THAT(MessageOf([&] { Load(file); }),
                AllOf(HasSubstr("scene.gltf: light 0 'hole'"), HasSubstr("negative")));
}

}  // namespace
}  // namespace relume::test
