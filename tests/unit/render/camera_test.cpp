#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "tests/support/scenes.h"
#include "worker/render/camera/ray_camera.h"

namespace relume::render {
namespace {

void ExpectNear(Vec3f a, Vec3f b, float tolerance = 1e-5f) {
    EXPECT_NEAR(a.x, b.x, tolerance);
    EXPECT_NEAR(a.y, b.y, tolerance);
    EXPECT_NEAR(a.z, b.z, tolerance);
}

RenderSettings Size(int width, int height) { return test::Settings(width, height, 4); }

TEST(Camera, PerspectiveRays) {
    // At (1, 2, 3), looking along -z; full vertical angle 90 degrees, twice as wide as high.
    Camera camera = test::PerspectiveCamera({1, 2, 3}, {1, 2, 0}, kPi / 2);
    const RayCamera c = CompileCamera(camera, Size(200, 100));
    const CameraRay middle = c.Generate({100, 50}, {});
    ExpectNear(middle.origin, {1, 2, 3});
    ExpectNear(middle.direction, {0, 0, -1});
    ExpectNear(c.Generate({100, 0}, {}).direction, Normalize({0, 1, -1}));  // row 0 is the top
    ExpectNear(c.Generate({0, 50}, {}).direction, Normalize({-2, 0, -1}));
    ExpectNear(c.Generate({200, 100}, {}).direction, Normalize({2, -1, -1}));
}

TEST(Camera, XfovIsTheFullHorizontalAngle) {
    Camera camera = test::PerspectiveCamera({0, 0, 0}, {0, 0, -1}, 0.5f);
    camera.params = ParamSet();
    camera.params.Set("xfov", kPi / 2);
    const RayCamera c = CompileCamera(camera, Size(200, 100));
    ExpectNear(c.Generate({200, 50}, {}).direction, Normalize({1, 0, -1}));
    ExpectNear(c.Generate({100, 0}, {}).direction, Normalize({0, 0.5f, -1}));
}

TEST(Camera, ScaleOfItsNodeDoesNotMatter) {
    Camera camera = test::PerspectiveCamera({1, 2, 3}, {4, 5, 6}, 0.8f);
    const RayCamera plain = CompileCamera(camera, Size(64, 64));
    camera.to_world = camera.to_world * Transform::Scale({7, 7, 7});
    const RayCamera scaled = CompileCamera(camera, Size(64, 64));
    ExpectNear(plain.Generate({3, 9}, {}).direction, scaled.Generate({3, 9}, {}).direction);
}

TEST(Camera, OrthographicRaysAreParallel) {
    Camera camera;
    camera.type = "orthographic";
    camera.params.Set("ymag", 2.0f);
    const RayCamera c = CompileCamera(camera, Size(200, 100));
    ExpectNear(c.Generate({0, 0}, {}).origin, {-4, 2, 0});
    ExpectNear(c.Generate({0, 0}, {}).direction, {0, 0, -1});
    ExpectNear(c.Generate({150, 75}, {}).origin, {2, -1, 0});
}

TEST(Camera, FovShortIsAlongTheShorterSide) {
    Camera camera;
    camera.type = "perspective";
    camera.params.Set("fov_short", kPi / 2);
    const RayCamera wide = CompileCamera(camera, Size(200, 100));
    ExpectNear(wide.Generate({0, 0}, {}).direction, Normalize({-2, 1, -1}));
    const RayCamera tall = CompileCamera(camera, Size(100, 300));
    ExpectNear(tall.Generate({100, 300}, {}).direction, Normalize({1, -3, -1}));
}

TEST(Camera, MagShortIsHalfTheShorterSide) {
    Camera camera;
    camera.type = "orthographic";
    camera.params.Set("mag_short", 2.0f);
    ExpectNear(CompileCamera(camera, Size(200, 100)).Generate({0, 0}, {}).origin, {-4, 2, 0});
    ExpectNear(CompileCamera(camera, Size(100, 200)).Generate({0, 0}, {}).origin, {-2, 4, 0});
}

TEST(Camera, ScreenWindowIsWhatIsSeen) {
    Camera camera;
    camera.type = "perspective";
    camera.params.Set("fov_short", 2 * std::atan(0.5f));
    camera.params.Set("screen_window", std::vector<float>{-1, 3, 0, 2});
    const RayCamera c = CompileCamera(camera, Size(100, 100));
    ExpectNear(c.Generate({0, 0}, {}).direction, Normalize({-0.5f, 1, -1}));
    ExpectNear(c.Generate({100, 100}, {}).direction, Normalize({1.5f, 0, -1}));

    Camera flat;
    flat.type = "orthographic";
    flat.params.Set("mag_short", 7.0f);
    flat.params.Set("screen_window", std::vector<float>{-1, 3, 0, 2});
    ExpectNear(CompileCamera(flat, Size(100, 50)).Generate({100, 50}, {}).origin, {3, 0, 0});
    for (const std::vector<float>& bad :
         {std::vector<float>{0, 1, 2}, {1, 1, 0, 2}, {0, 1, 3, 2}, {0, INFINITY, 0, 1}}) {
        flat.params.Set("screen_window", bad);
        EXPECT_THROW(CompileCamera(flat, Size(8, 8)), Error);
    }
}

TEST(Camera, MirroredNodeMirrorsThePicture) {
    for (const char* type : {"perspective", "orthographic"}) {
        Camera camera;
        camera.type = type;
        camera.params.Set("lens_radius", 0.1f);
        camera.params.Set("focus_distance", 3.0f);
        const Transform place = Transform::LookAt({1, 2, 3}, {-4, 3, 1}, {0, 1, 0});
        camera.to_world = place;
        const RayCamera plain = CompileCamera(camera, Size(64, 32));
        camera.to_world = place * Transform::Scale({-1, 1, 1});
        const RayCamera mirrored = CompileCamera(camera, Size(64, 32));
        EXPECT_LT(Dot(Cross(mirrored.right, mirrored.up), mirrored.forward * -1.0f), -0.99f);
        // Of the lens both coordinates are turned: (u, v) to (1 - u, v) mirrors the disk.
        const CameraRay a = plain.Generate({10, 5}, {0.3f, 0.8f});
        const CameraRay b = mirrored.Generate({54, 5}, {0.7f, 0.8f});
        ExpectNear(a.origin, b.origin);
        ExpectNear(a.direction, b.direction);
    }
}

TEST(Camera, OrthographicLensRaysMeetInThePlaneOfFocus) {
    Camera camera;
    camera.type = "orthographic";
    camera.params.Set("lens_radius", 0.25f);
    camera.params.Set("focus_distance", 4.0f);
    const RayCamera c = CompileCamera(camera, Size(100, 100));
    for (const Vec2f u : {Vec2f{0.1f, 0.9f}, {0.6f, 0.2f}}) {
        const CameraRay ray = c.Generate({75, 50}, u);
        EXPECT_GT(Length(ray.origin - Vec3f{0.5f, 0, 0}), 0.01f);
        ExpectNear(ray.origin + ray.direction * (-4 / ray.direction.z), {0.5f, 0, -4});
    }
}

TEST(Camera, LensRaysMeetInThePlaneOfFocus) {
    Camera camera = test::PerspectiveCamera({0, 0, 0}, {0, 0, -1}, 1);
    camera.params.Set("lens_radius", 0.25f);
    camera.params.Set("focus_distance", 4.0f);
    const RayCamera c = CompileCamera(camera, Size(64, 48));
    const RayCamera pinhole =
        CompileCamera(test::PerspectiveCamera({0, 0, 0}, {0, 0, -1}, 1), Size(64, 48));
    for (const Vec2f film : {Vec2f{32, 24}, {3, 40}, {60, 2}}) {
        const Vec3f through = pinhole.Generate(film, {}).direction;
        const Vec3f focus = through * (-4 / through.z);
        float widest = 0;
        for (const Vec2f u : {Vec2f{0.5f, 0.5f}, {0, 0.5f}, {0.9f, 0.1f}, {0.3f, 0.99f}}) {
            const CameraRay ray = c.Generate(film, u);
            EXPECT_NEAR(ray.origin.z, 0, 1e-6f);
            widest = std::max(widest, Length(ray.origin));
            EXPECT_NEAR(Length(ray.direction), 1, 1e-6f);
            ExpectNear(ray.origin + ray.direction * (-4 / ray.direction.z), focus, 1e-4f);
        }
        EXPECT_NEAR(widest, 0.25f, 0.01f);
    }
}

TEST(Camera, SettingsOverrideTheLens) {
    Camera camera = test::PerspectiveCamera({0, 0, 0}, {0, 0, -1}, 1);
    camera.params.Set("lens_radius", 0.25f);
    RenderSettings settings = Size(8, 8);
    settings.lens_radius = 0;
    EXPECT_EQ(CompileCamera(camera, settings).lens_radius, 0);
    settings.lens_radius = 2;
    settings.focus_distance = 9;
    EXPECT_EQ(CompileCamera(camera, settings).lens_radius, 2);
    EXPECT_EQ(CompileCamera(camera, settings).focus_distance, 9);
}

TEST(Camera, IsChosenByNameOrIndex) {
    Scene scene;
    scene.cameras = {test::PerspectiveCamera({1, 0, 0}, {0, 0, 0}, 1),
                     test::PerspectiveCamera({2, 0, 0}, {0, 0, 0}, 1)};
    scene.cameras[1].name = "side";
    std::vector<std::string> notes;
    RenderSettings settings = Size(8, 8);
    EXPECT_EQ(ChooseCamera(scene, scene.Bounds(), settings, &notes).name, "camera");
    settings.camera = "side";
    EXPECT_EQ(ChooseCamera(scene, scene.Bounds(), settings, &notes).name, "side");
    settings.camera = std::string("1");
    EXPECT_EQ(ChooseCamera(scene, scene.Bounds(), settings, &notes).name, "side");
    settings.camera = "top";
    try {
        ChooseCamera(scene, scene.Bounds(), settings, &notes);
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("'side'"));
    }
}

TEST(Camera, UnknownParameterIsNamed) {
    Camera camera = test::PerspectiveCamera({0, 0, 0}, {0, 0, -1}, 1);
    camera.params.Set("yfoov", 1.0f);
    try {
        CompileCamera(camera, Size(8, 8));
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("yfoov"));
    }
}

}  // namespace
}  // namespace relume::render
