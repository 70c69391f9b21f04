#include <cmath>

#include "core/math/keys.h"
#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

void ExpectNear(Vec3f a, Vec3f b, float tolerance = 1e-5f) {
    EXPECT_LT(Length(a - b), tolerance) << a.x << " " << a.y << " " << a.z;
}

// Animates a property of node 0.
void Animate(GltfFile* file, const char* path, const std::vector<float>& times,
             const std::vector<float>& values, const char* interpolation = "LINEAR",
             const char* type = nullptr, int node = 0) {
    if (type == nullptr) {
        type = path == std::string("rotation")  ? "VEC4"
               : path == std::string("weights") ? "SCALAR"
                                                : "VEC3";
    }
    const int input = file->AddFloats(times, "SCALAR"), output = file->AddFloats(values, type);
    file->Add(
        "animations",
        {{"samplers",
          json::array({{{"input", input}, {"output", output}, {"interpolation", interpolation}}})},
         {"channels",
          json::array({{{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}})}});
}

Scene At(const GltfFile& file, float time, float shutter = 0) {
    LoadOptions options;
    options.decode_images = false;
    options.time = time;
    options.shutter = shutter;
    return Load(file.Files(), options);
}

Vec3f Origin(const Scene& scene) { return scene.instances[0].to_world.Point({0, 0, 0}); }

TEST(GltfAnimation, LinearTranslationClampsAtItsEnds) {
    GltfFile file = TriangleFile();
    file.json["nodes"][0]["translation"] = {9, 9, 9};
    Animate(&file, "translation", {1, 2, 4}, {0, 0, 0, 2, 0, 0, 2, 8, 0});
    ExpectNear(Origin(At(file, -1)), {0, 0, 0});
    ExpectNear(Origin(At(file, 0.5f)), {0, 0, 0});
    ExpectNear(Origin(At(file, 1.25f)), {0.5f, 0, 0});
    ExpectNear(Origin(At(file, 3)), {2, 4, 0});
    ExpectNear(Origin(At(file, 99)), {2, 8, 0});
    EXPECT_EQ(At(file, 0).hints.animation_seconds, 4);
    EXPECT_EQ(Load(TriangleFile()).hints.animation_seconds, 0);
    EXPECT_THAT(At(file, 0).notes, IsEmpty());
}

TEST(GltfAnimation, StepAndCubicSpline) {
    GltfFile step = TriangleFile();
    Animate(&step, "translation", {0, 1}, {1, 0, 0, 2, 0, 0}, "STEP");
    ExpectNear(Origin(At(step, 0.99f)), {1, 0, 0});
    ExpectNear(Origin(At(step, 1)), {2, 0, 0});

    // Over 2 seconds, from 1 with slope 3 to 5 with slope -1 (x), and 0 to 1 without slopes (y).
    GltfFile cubic = TriangleFile();
    Animate(&cubic, "translation", {1, 3}, {7, 7, 7, 1, 0, 0, 3, 0, 0, -1, 0, 0, 5, 1, 0, 7, 7, 7},
            "CUBICSPLINE");
    ExpectNear(Origin(At(cubic, 1)), {1, 0, 0});
    ExpectNear(Origin(At(cubic, 3)), {5, 1, 0});
    // At half: (p0 + p1) / 2 + 2 (m0 - m1) / 8; at a quarter, y = 3/16 - 2/64.
    ExpectNear(Origin(At(cubic, 2)), {4, 0.5f, 0});
    EXPECT_NEAR(Origin(At(cubic, 1.5f)).y, 0.15625f, 1e-6f);
}

TEST(GltfAnimation, RotationGoesTheShorterWayAtEvenSpeed) {
    // From 0 to 90 degrees about z; the second quaternion has the other sign.
    GltfFile file = TriangleFile();
    const float s = std::sqrt(0.5f);
    Animate(&file, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0, -s, -s});
    const Scene scene = At(file, 1.0f / 3);
    const float angle = kPi / 6;
    ExpectNear(scene.instances[0].to_world.Point({1, 0, 0}), {std::cos(angle), std::sin(angle), 0});
}

TEST(GltfAnimation, RotationBySplineIsNormalised) {
    // From the identity to a turn about z whose quaternions are (0, 0, z, w); slopes in z alone. By
    // the formula of appendix C.5 at a quarter of 2 seconds, then unit length (section 3.11).
    const float z1 = 0.6f, w1 = 0.8f, out0 = 0.3f, in1 = -0.1f, t = 0.25f, length = 2;
    GltfFile file = TriangleFile();
    Animate(&file, "rotation", {0, length},
            {0, 0, 0, 0, 0, 0, 0, 1, 0, 0, out0, 0, 0, 0, in1, 0, 0, 0, z1, w1, 0, 0, 0, 0},
            "CUBICSPLINE");
    const float t2 = t * t, t3 = t2 * t;
    const float z =
        length * (t3 - 2 * t2 + t) * out0 + (-2 * t3 + 3 * t2) * z1 + length * (t3 - t2) * in1;
    const float w = (2 * t3 - 3 * t2 + 1) + (-2 * t3 + 3 * t2) * w1;
    const float angle = 2 * std::atan2(z, w);
    ExpectNear(At(file, t * length).instances[0].to_world.Point({1, 0, 0}),
               {std::cos(angle), std::sin(angle), 0});
}

TEST(GltfTimes, GiveTheSceneThatLoadingAgainGives) {
    GltfFile file = TriangleFile();
    Animate(&file, "translation", {0, 2}, {0, 0, 0, 4, 0, 0});
    file.json["extensionsUsed"] = {"ACME_unheard_of"};
    LoadOptions options;
    options.time = 0.25f;
    std::shared_ptr<const SceneTimes> times;
    options.times = &times;
    Load(file.Files(), options);
    ASSERT_NE(times, nullptr);
    for (const auto& [time, shutter] : {std::pair(0.0f, 0.0f), {1.5f, 0.0f}, {0.5f, 0.25f}}) {
        const Scene a = times->At(time, shutter), b = At(file, time, shutter);
        ExpectNear(Origin(a), {2 * time, 0, 0});
        EXPECT_EQ(a.instances[0].to_world, b.instances[0].to_world);
        EXPECT_EQ(a.instances[0].motion, b.instances[0].motion);
        EXPECT_EQ(a.meshes[0].positions, b.meshes[0].positions);
        EXPECT_EQ(a.name, b.name);
        EXPECT_EQ(a.notes, b.notes);
        EXPECT_EQ(a.notes.size(), 1u);
        EXPECT_EQ(a.hints.animation_seconds, 2);
    }
    // Nothing is kept of what has one time only.
    Load(TriangleFile().Files(), options);
    EXPECT_EQ(times, nullptr);
}

TEST(GltfTimes, AnyNumberOfReadingsHasTheRoomOfOne) {
    GltfFile file = TriangleFile();
    Animate(&file, "translation", {0, 2}, {0, 0, 0, 4, 0, 0});
    LoadOptions options;
    options.time = 0;
    options.most_array_bytes = 1024;
    std::shared_ptr<const SceneTimes> times;
    options.times = &times;
    Load(file.Files(), options);
    ASSERT_NE(times, nullptr);
    for (int i = 0; i < 100; ++i) {
        ASSERT_NO_THROW(times->At(1, 0)) << i;
    }
}

TEST(GltfAnimation, ScaleOfZeroHidesInsteadOfFailing) {
    GltfFile file = TriangleFile();
    Animate(&file, "scale", {0, 1}, {0, 0, 0, 1, 1, 1}, "STEP");
    EXPECT_LT(Length(At(file, 0).instances[0].to_world.Vector({1, 0, 0})), 1e-5f);
    ExpectNear(At(file, 1).instances[0].to_world.Vector({1, 0, 0}), {1, 0, 0});
    // Even if the node hides it at rest, and files are listed.
    file.json["nodes"][0]["scale"] = {0, 0, 0};
    EXPECT_NO_THROW(At(file, 1));
    EXPECT_NO_THROW(ListSceneFiles(file.Files(), "scene.gltf"));
}

TEST(GltfAnimation, ParentsMoveTheirChildren) {
    GltfFile file = TriangleFile();
    file.json["nodes"][0]["translation"] = {0, 1, 0};
    file.json["scenes"][0]["nodes"] = json::array();
    file.AddNode({{"children", {0}}});
    Animate(&file, "translation", {0, 1}, {0, 0, 0, 3, 0, 0}, "LINEAR", nullptr, 1);
    ExpectNear(Origin(At(file, 0.5f)), {1.5f, 1, 0});
}

TEST(GltfMotion, KeysOnlyForWhatMovesWhileTheShutterIsOpen) {
    GltfFile file = TriangleFile();
    file.AddNode({{"mesh", 0}});
    Animate(&file, "translation", {1, 2}, {0, 0, 0, 4, 0, 0});
    EXPECT_THAT(At(file, 1.25f).instances[0].motion, IsEmpty());  // no shutter
    const Scene scene = At(file, 1.25f, 0.5f);
    ASSERT_EQ(scene.instances[0].motion.size(), 2u);
    EXPECT_THAT(scene.instances[1].motion, IsEmpty());
    ExpectNear(Origin(scene), {1, 0, 0});
    EXPECT_EQ(scene.instances[0].motion[0], scene.instances[0].to_world);
    ExpectNear(scene.instances[0].motion[1].Point({0, 0, 0}), {3, 0, 0});
    EXPECT_THAT(At(file, 2, 0.5f).instances[0].motion, IsEmpty());  // after the end
    // The end falls into the open shutter: moving, then still.
    const Scene stops = At(file, 1.5f, 1);
    EXPECT_EQ(stops.instances[0].motion.size(), 3u);
    ExpectNear(stops.instances[0].motion[1].Point({0, 0, 0}), {4, 0, 0});
}

TEST(GltfMotion, WheelsGetKeysByTheirTurn) {
    GltfFile file = TriangleFile();
    const float s = std::sqrt(0.5f);
    Animate(&file, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0, s, s});  // 90 degrees a second
    EXPECT_EQ(At(file, 0, 0.04f).instances[0].motion.size(), 2u);
    const Scene scene = At(file, 0, 1);
    ASSERT_EQ(scene.instances[0].motion.size(), 17u);
    const Vec3f p = Interpolate(scene.instances[0].motion, 0.28f).Point({1, 0, 0});
    const float angle = kPi / 2 * 0.28f;
    ExpectNear(p, {std::cos(angle), std::sin(angle), 0}, 1.5e-3f);
}

TEST(GltfMotion, CamerasMoveWithoutScaleAndLightsStay) {
    GltfFile file = TriangleFile();
    file.Add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 1}}}});
    file.AddNode({{"camera", 0}, {"scale", {2, 2, 2}}});
    Animate(&file, "translation", {0, 1}, {0, 0, 0, 4, 0, 0}, "LINEAR", nullptr, 1);
    file.json["extensionsUsed"] = {"KHR_lights_punctual"};
    file.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    file.json["nodes"][1]["extensions"]["KHR_lights_punctual"] = {{"light", 0}};
    const Scene scene = At(file, 0.25f, 0.5f);
    ASSERT_EQ(scene.cameras[0].motion.size(), 2u);
    ExpectNear(scene.cameras[0].motion[1].Point({0, 0, 1}), {3, 0, 1});
    ExpectNear(scene.lights[0].to_world.Point({0, 0, 0}), {2, 0, 0});
    EXPECT_THAT(scene.notes, ElementsAre(HasSubstr("light 0: moves while the shutter is open")));
}

TEST(GltfAnimation, OfTwoForOnePropertyTheFirstCounts) {
    GltfFile file = TriangleFile();
    Animate(&file, "translation", {0, 1}, {0, 0, 0, 4, 0, 0});
    Animate(&file, "translation", {0, 1}, {0, 0, 0, 0, 4, 0});
    Animate(&file, "scale", {0, 1}, {1, 1, 1, 3, 3, 3});
    const Scene scene = At(file, 1);
    ExpectNear(scene.instances[0].to_world.Point({1, 0, 0}), {7, 0, 0});
    EXPECT_THAT(scene.notes, ElementsAre(HasSubstr("animation 1, channel 0: ignored")));
}

TEST(GltfAnimation, OfOtherThingsIsIgnoredAndSaid) {
    GltfFile file = TriangleFile();
    Animate(&file, "translation", {0, 1}, {0, 0, 0, 4, 0, 0});
    file.json["animations"][0]["channels"].push_back(
        {{"sampler", 0}, {"target", {{"path", "pointer"}}}});
    EXPECT_THAT(At(file, 0).notes, ElementsAre(HasSubstr("animations of other things")));
}

TEST(GltfAnimation, FaultsNameAnimationAndChannel) {
    const auto message = [](auto&& change, const std::vector<float>& times = {0, 1},
                            const std::vector<float>& values = {0, 0, 0, 1, 1, 1},
                            const char* interpolation = "LINEAR", const char* type = nullptr) {
        GltfFile file = TriangleFile();
        Animate(&file, "translation", times, values, interpolation, type);
        change(&file);
        return MessageOf([&] { At(file, 0); });
    };
    const auto as_is = [](GltfFile*) {};
    EXPECT_THAT(message(as_is, {0, 0}),
                HasSubstr("scene.gltf: animation 0, channel 0: the time of key 1 is 0"));
    EXPECT_THAT(message(as_is, {0, NAN}), HasSubstr("channel 0: the time of key 1 is nan"));
    EXPECT_THAT(message(as_is, {0, 1}, {0, 0, 0}), HasSubstr("has 2 keys and 3 numbers"));
    EXPECT_THAT(message(as_is, {0, 1}, {0, 0, 0, 1, INFINITY, 1}), HasSubstr("is not finite"));
    EXPECT_THAT(message(as_is, {0, 1}, {0, 0, 0, 1, 1, 1}, "CUBICSPLINE"),
                HasSubstr("channel 0: has 2 keys"));
    EXPECT_THAT(message(as_is, {0, 1}, {0, 0, 0, 1}, "LINEAR", "VEC2"),
                HasSubstr("channel 0: output: accessor"));
    EXPECT_THAT(message(as_is, {0, 1}, {0, 0, 0, 1, 1, 1}, "BEZIER"), HasSubstr("'BEZIER'"));
    const auto target = [](const char* what, json value) {
        return [what, value](GltfFile* file) {
            json& channel = file->json["animations"][0]["channels"][0];
            (what == std::string("sampler") ? channel : channel["target"])[what] = value;
        };
    };
    EXPECT_THAT(message(target("node", 7)), HasSubstr("channel 0: node 7 does not exist"));
    EXPECT_THAT(message(target("sampler", 7)), HasSubstr("channel 0: sampler 7 does not exist"));
    EXPECT_THAT(message([](GltfFile* file) {
                    file->json["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0,
                                                        0, 0, 1, 0, 0, 0, 0, 1};
                }),
                HasSubstr("node 0: has a matrix and is animated"));
    EXPECT_THAT(
        message([](GltfFile* file) { file->json["animations"][0]["samplers"][0]["output"] = 99; }),
        HasSubstr("accessor 99 does not exist"));
}

}  // namespace
}  // namespace relume::test
