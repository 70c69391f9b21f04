#include <cmath>

#include "tests/unit/scene/pbrt_file.h"

namespace relume::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

void ExpectNear(Vec3f a, Vec3f b) {
    EXPECT_NEAR(a.x, b.x, 1e-5f);
    EXPECT_NEAR(a.y, b.y, 1e-5f);
    EXPECT_NEAR(a.z, b.z, 1e-5f);
}

Camera LoadCamera(const std::string& before_world) {
    return LoadPbrtText(before_world + "\nWorldBegin\n" + kPbrtTriangle).cameras.at(0);
}

// In camera space: x to the right, y up, looking along -z.
Vec3f Seen(const Camera& camera, Vec3f world) { return camera.to_world.Inverse().Point(world); }

TEST(PbrtCamera, LooksAlongPlusZWithXToTheRight) {
    // pbrt's world is left-handed: without a transformation +x is to the right.
    const Camera camera = LoadCamera("Camera \"perspective\"");
    ExpectNear(Seen(camera, {1, 2, 5}), {1, 2, -5});
}

TEST(PbrtCamera, LookAtSeesTheTargetInFront) {
    const Camera camera = LoadCamera("LookAt 3 4 1.5  .5 .5 0  0 0 1\nCamera \"perspective\"");
    const float distance = std::sqrt(2.5f * 2.5f + 3.5f * 3.5f + 1.5f * 1.5f);
    ExpectNear(Seen(camera, {0.5f, 0.5f, 0}), {0, 0, -distance});
    ExpectNear(camera.to_world.Point({0, 0, 0}), {3, 4, 1.5f});
    // To the right is the up vector times the direction: (0,0,1) x (-2.5,-3.5,-1.5).
    EXPECT_GT(Seen(camera, {3 + 3.5f, 4 - 2.5f, 0}).x, 0);
    EXPECT_GT(Seen(camera, {0.5f, 0.5f, 1}).y, 0);
}

TEST(PbrtCamera, AFlippedImageIsAsPbrtHasIt) {
    const Camera camera =
        LoadCamera("Scale -1 1 1\nLookAt 0 0 -4 0 0 0 0 1 0\nCamera \"perspective\"");
    ExpectNear(Seen(camera, {1, 0.5f, 0}), {-1, 0.5f, -4});
}

TEST(PbrtCamera, FovIsAlongTheShorterSide) {
    const Camera camera = LoadCamera("Camera \"perspective\" \"float fov\" 40");
    EXPECT_NEAR(camera.params.GetFloat("fov_short", 0), 40 * kPi / 180, 1e-6f);
    EXPECT_EQ(camera.type, "perspective");
    EXPECT_FALSE(camera.params.Has("screen_window"));
    EXPECT_NEAR(LoadCamera("Camera \"perspective\"").params.GetFloat("fov_short", 0), kPi / 2,
                1e-6f);
    EXPECT_NEAR(
        LoadCamera("Camera \"perspective\" \"float halffov\" 10").params.GetFloat("fov_short", 0),
        20 * kPi / 180, 1e-6f);
}

TEST(PbrtCamera, ScreenWindowAndFrameShape) {
    EXPECT_THAT(LoadCamera("Camera \"perspective\" \"float screenwindow\" [-1 2 -3 4]")
                    .params.GetFloats("screen_window", {}),
                ElementsAre(-1, 2, -3, 4));
    EXPECT_THAT(LoadCamera("Camera \"perspective\" \"float frameaspectratio\" 2")
                    .params.GetFloats("screen_window", {}),
                ElementsAre(-2, 2, -1, 1));
    EXPECT_THAT(LoadCamera("Camera \"perspective\" \"float frameaspectratio\" .5")
                    .params.GetFloats("screen_window", {}),
                ElementsAre(-1, 1, -2, 2));
}

TEST(PbrtCamera, ScaleOfTheTransformationGoesToLensAndFrame) {
    // World to camera halves lengths: a lens of 0.1 camera units is 0.2 in the world.
    const Camera camera = LoadCamera(
        "Scale .5 .5 .5\nCamera \"perspective\" \"float lensradius\" .1 \"float focaldistance\" 3");
    EXPECT_NEAR(camera.params.GetFloat("lens_radius", 0), 0.2f, 1e-6f);
    EXPECT_NEAR(camera.params.GetFloat("focus_distance", 0), 6, 1e-5f);
    ExpectNear(Seen(camera, {1, 2, 5}), {1, 2, -5});
    const Camera flat = LoadCamera("Scale .5 .5 .5\nCamera \"orthographic\"");
    EXPECT_EQ(flat.type, "orthographic");
    EXPECT_NEAR(flat.params.GetFloat("mag_short", 0), 2, 1e-6f);
}

TEST(PbrtCamera, HintsAreThoseOfTheFile) {
    const Scene scene = LoadPbrtText(
        std::string("Film \"image\" \"integer xresolution\" 720 \"integer yresolution\" 1280\n"
                    "Sampler \"sobol\" \"integer pixelsamples\" 64\nIntegrator \"path\" \"integer "
                    "maxdepth\" 65\nPixelFilter \"triangle\" \"float xwidth\" 1\n"
                    "Camera \"perspective\"\nWorldBegin\n") +
        kPbrtTriangle + "WorldEnd");
    EXPECT_EQ(scene.hints.width, 720);
    EXPECT_EQ(scene.hints.height, 1280);
    EXPECT_EQ(scene.hints.spp, 64);
    EXPECT_EQ(scene.hints.max_depth, 66);
    EXPECT_EQ(Text(scene), "");
    EXPECT_EQ(LoadPbrtWorld("").hints.width, 0);
}

TEST(PbrtTransforms, AreAppliedInOrder) {
    const Scene scene = LoadPbrtWorld("Translate 1 2 3 Scale 2 3 4 Rotate 90 0 0 1\n");
    ExpectNear(scene.instances[0].to_world.Point({1, 0, 0}), {1, 5, 3});
    const Scene matrix = LoadPbrtWorld(
        "Translate 9 9 9 Transform [1 0 0 0 0 0 1 0 0 -1 0 0 5 6 7 1]\nConcatTransform [2 0 0 0 0 "
        "2 0 "
        "0 0 0 2 0 1 0 0 1]\n");
    ExpectNear(matrix.instances[0].to_world.Point({0, 1, 0}), {6, 6, 9});
}

TEST(PbrtTransforms, BlocksRestore) {
    const std::string shape = kPbrtTriangle;
    const Scene scene = LoadPbrtWorld(
        "AttributeBegin Translate 1 0 0\n" + shape + "AttributeEnd\n" +
        "TransformBegin Translate 2 0 0 Material \"mirror\"\n" + shape + "TransformEnd\n");
    EXPECT_EQ(scene.instances[0].to_world.Point({}).x, 1);
    EXPECT_EQ(scene.instances[1].to_world.Point({}).x, 2);
    EXPECT_EQ(scene.instances[2].to_world.Point({}).x, 0);
    // TransformEnd leaves the material alone.
    EXPECT_EQ(scene.meshes[2].material, scene.meshes[1].material);
    EXPECT_NE(scene.meshes[2].material, scene.meshes[0].material);
}

TEST(PbrtTransforms, NamedSystems) {
    const Scene scene = LoadPbrtText(
        std::string("Translate 0 0 5 Camera \"perspective\"\nWorldBegin\nTranslate 7 0 0 "
                    "CoordinateSystem \"here\" Identity\n") +
        "CoordSysTransform \"here\"\n" + kPbrtTriangle + "CoordSysTransform \"camera\"\n" +
        kPbrtTriangle);
    EXPECT_EQ(scene.instances[0].to_world.Point({}).x, 7);
    EXPECT_EQ(scene.instances[1].to_world.Point({}).z, -5);
}

TEST(PbrtInstances, ObjectsAreSharedAndPlaced) {
    const Scene scene = LoadPbrtWorld(
        std::string("Translate 1 0 0 ObjectBegin \"o\" Scale 2 2 2\n") + kPbrtTriangle +
        "Shape \"sphere\"\nObjectEnd Identity\n"
        "Translate 0 10 0 ObjectInstance \"o\"\nTranslate 0 10 0 "
        "ObjectInstance \"o\"\nObjectBegin \"unused\"\n" +
        kPbrtTriangle + "ObjectEnd\n");
    EXPECT_EQ(scene.meshes.size(), 3u);
    ASSERT_EQ(scene.instances.size(), 5u);
    // The use's transformation, then that of the object's own shape.
    ExpectNear(scene.instances[1].to_world.Point({1, 0, 0}), {3, 10, 0});
    ExpectNear(scene.instances[3].to_world.Point({1, 0, 0}), {3, 20, 0});
    EXPECT_EQ(scene.instances[1].mesh, scene.instances[3].mesh);
}

TEST(PbrtInstances, EqualQuadricsShareAMesh) {
    const Scene scene = LoadPbrtWorld(
        "Shape \"sphere\" \"float radius\" 2\nShape \"sphere\" \"float radius\" .5\n"
        "Material \"mirror\" Shape \"sphere\"\n");
    EXPECT_EQ(scene.instances[0].mesh, scene.instances[1].mesh);
    EXPECT_NE(scene.instances[2].mesh, scene.instances[1].mesh);
}

}  // namespace
}  // namespace relume::test
