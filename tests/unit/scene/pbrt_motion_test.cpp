#include <cmath>

#include "core/math/keys.h"
#include "tests/unit/scene/pbrt_file.h"

namespace relume::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

void ExpectNear(Vec3f a, Vec3f b, float tolerance = 1e-5f) {
    EXPECT_LT(Length(a - b), tolerance) << a.x << " " << a.y << " " << a.z;
}

const std::string kMoveX = "ActiveTransform EndTime Translate 4 0 0 ActiveTransform All\n";

Scene At(const std::string& text, float time, float shutter) {
    MapSource files;
    files.files["scene.pbrt"] = text;
    return LoadScene(files, "scene.pbrt",
                     {.decode_images = false, .time = time, .shutter = shutter});
}

std::string World(const std::string& world) { return "WorldBegin\n" + world + kPbrtTriangle; }

Vec3f Origin(const Transform& transform) { return transform.Point({0, 0, 0}); }

TEST(PbrtMotion, ShapesMoveWhileTheShutterIsOpen) {
    const Scene scene = At(World(kMoveX), -1, -1);  // pbrt's shutter: 0 to 1
    ASSERT_EQ(scene.instances[0].motion.size(), 2u);
    ExpectNear(Origin(scene.instances[0].to_world), {0, 0, 0});
    ExpectNear(Origin(scene.instances[0].motion[1]), {4, 0, 0});
    EXPECT_THAT(Text(scene), testing::Not(HasSubstr("motion")));
    EXPECT_EQ(scene.hints.animation_seconds, 1);
    EXPECT_EQ(At(World(""), -1, -1).hints.animation_seconds, 0);
}

TEST(PbrtMotion, TimesOfShutterTransformsAndOptions) {
    const std::string camera =
        "Camera \"perspective\" \"float shutteropen\" 2 \"float shutterclose\" 3\n";
    const std::string times = "TransformTimes 1 5\n";  // 1 unit a second
    const Scene scene = At(times + camera + World(kMoveX), -1, -1);
    ExpectNear(Origin(scene.instances[0].to_world), {1, 0, 0});
    ExpectNear(Origin(scene.instances[0].motion.back()), {2, 0, 0});
    const Scene later = At(times + camera + World(kMoveX), 3, -1);
    ExpectNear(Origin(later.instances[0].motion.back()), {3, 0, 0});
    const Scene still = At(times + camera + World(kMoveX), -1, 0);
    EXPECT_THAT(still.instances[0].motion, IsEmpty());
    ExpectNear(Origin(still.instances[0].to_world), {1, 0, 0});
    // Beyond the last time it stands still.
    const Scene half = At(times + camera + World(kMoveX), 4, 2);
    ASSERT_EQ(half.instances[0].motion.size(), 3u);
    ExpectNear(Origin(half.instances[0].motion[1]), {4, 0, 0});
    ExpectNear(Origin(half.instances[0].motion[2]), {4, 0, 0});
    EXPECT_THAT(At(times + World(kMoveX), 5, 2).instances[0].motion, IsEmpty());
    EXPECT_THAT(MessageOf([] { At("TransformTimes 1 1\n" + World(""), -1, -1); }),
                HasSubstr("scene.pbrt:1:1: TransformTimes"));
}

TEST(PbrtMotion, RotationsAreEvenAndKeepTheirScale) {
    const Scene scene = At(World("Translate 1 2 3\nActiveTransform EndTime Rotate 80 0 0 1\n"
                                 "ActiveTransform All Scale 2 2 -2\n"),
                           -1, -1);
    const auto& motion = scene.instances[0].motion;
    ASSERT_EQ(motion.size(), 17u);
    for (const float t : {0.0f, 0.25f, 0.5f, 0.875f, 1.0f}) {
        const float angle = 80 * kPi / 180 * t;
        ExpectNear(Interpolate(motion, t).Point({1, 0, 1}),
                   {1 + 2 * std::cos(angle), 2 + 2 * std::sin(angle), 1}, 2e-3f);
    }
}

TEST(PbrtMotion, ObjectsMoveAndSoDoTheirShapes) {
    const Scene scene =
        At("WorldBegin\nObjectBegin \"o\"\nActiveTransform EndTime Translate 0 3 0\n"
           "ActiveTransform All\n" +
               std::string(kPbrtTriangle) + "ObjectEnd\nObjectInstance \"o\"\n" + kMoveX +
               "ObjectInstance \"o\"\n",
           -1, -1);
    ASSERT_EQ(scene.instances.size(), 2u);
    ExpectNear(Origin(scene.instances[0].motion.back()), {0, 3, 0});
    ExpectNear(Origin(scene.instances[1].motion.back()), {4, 3, 0});
    EXPECT_EQ(scene.instances[0].mesh, scene.instances[1].mesh);
}

TEST(PbrtMotion, TheCameraMoves) {
    // World to camera: at the end the camera is at x = 2.
    const Scene scene =
        At("ActiveTransform EndTime Translate -2 0 0\nActiveTransform All\nCamera "
           "\"perspective\"\n" +
               World("CoordSysTransform \"camera\"\n"),
           -1, -1);
    ASSERT_EQ(scene.cameras[0].motion.size(), 2u);
    ExpectNear(Origin(scene.cameras[0].to_world), {0, 0, 0});
    ExpectNear(Origin(scene.cameras[0].motion[1]), {2, 0, 0});
    // What is placed by the camera's coordinates goes with it.
    ExpectNear(Origin(scene.instances[0].motion[1]), {2, 0, 0});
}

TEST(PbrtMotion, LightsStayWhichIsSaid) {
    const Scene scene = At(World(kMoveX + "LightSource \"point\"\n"), -1, -1);
    EXPECT_THAT(Text(scene), HasSubstr("scene.pbrt:3: motion of a light"));
    ExpectNear(Origin(scene.lights[0].to_world), {0, 0, 0});
}

TEST(PbrtMotion, LampsKeepTheirEmission) {
    const Scene scene =
        At(World("AreaLightSource \"diffuse\" \"rgb L\" [2 2 2]\n" + kMoveX), -1, -1);
    EXPECT_EQ(scene.instances[0].motion.size(), 2u);
    EXPECT_THAT(Floats(scene.materials[0], "emissive"), testing::Each(testing::Gt(0)));
}

}  // namespace
}  // namespace relume::test
