#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/scenes.h"

namespace relume::test {
namespace {

// A slanted square of half side `half`, lit by a directional light along its normal, seen from
// `distance` above its middle, all moved by `offset`. Every pixel shows albedo / pi.
std::shared_ptr<Scene> Slope(float half, float distance, Vec3f offset, bool smooth) {
    auto scene = std::make_shared<Scene>();
    scene->materials = {Diffuse({0.5f, 0.5f, 0.5f})};
    const Vec3f n = Normalize({0.3f, 0.8f, 0.52f});
    const Vec3f u = Normalize(Cross(n, {0.1f, -0.4f, 0.9f})), v = Cross(n, u);
    const Vec3f a = u * half, b = v * half;
    AddMesh(scene.get(), Quad(offset - a - b, offset + a - b, offset + a + b, offset - a + b, 0));
    if (smooth) {
        scene->meshes[0].normals.assign(4, n);
    }
    Light sun;
    sun.type = "directional";
    sun.params.Set("irradiance", std::vector<float>{1, 1, 1});
    sun.to_world = Transform::LookAt(n, {0, 0, 0}, u);
    scene->lights.push_back(sun);
    scene->cameras.push_back(PerspectiveCamera(offset + n * distance, offset, 0.8f, u));
    return scene;
}

void ExpectLit(const std::shared_ptr<Scene>& scene, const char* what) {
    // Two bounces: a path that met its own surface again would change the sum as well.
    const Film film = RenderAll(scene, Settings(24, 24, 4), 4);
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        ASSERT_NEAR(film.Mean(i).y, 0.5f * kInvPi, 1e-3f) << what << ", pixel " << i;
    }
}

TEST(SelfIntersection, PlaneOfAnySizeIsEvenlyLit) {
    for (const bool smooth : {false, true}) {
        ExpectLit(Slope(1e-4f, 1e-4f, {0, 0, 0}, smooth), "tiny");
        ExpectLit(Slope(1e-8f, 1e-8f, {0, 0, 0}, smooth), "very tiny");
        ExpectLit(Slope(1, 1, {0, 0, 0}, smooth), "plain");
        ExpectLit(Slope(1e6f, 1e6f, {0, 0, 0}, smooth), "huge");
        ExpectLit(Slope(1e10f, 1e10f, {0, 0, 0}, smooth), "very huge");
        ExpectLit(Slope(1e5f, 2, {0, 0, 0}, smooth), "huge ground, near camera");
        ExpectLit(Slope(10, 2, {1e4f, -2e4f, 3e4f}, smooth), "far from the origin");
    }
}

TEST(SelfIntersection, ClosedMeshesAreTight) {
    // A fine black sphere around the camera, the sky outside: no ray gets out between triangles.
    auto scene = std::make_shared<Scene>();
    scene->materials = {Diffuse({0, 0, 0})};
    AddMesh(scene.get(), Sphere(0, 256));
    SetEnvironment(scene.get(), {1, 1, 1});
    scene->cameras.push_back(PerspectiveCamera({0.1f, 0.2f, -0.3f}, {0.3f, 1, 0.4f}, 2));
    EXPECT_EQ(EstimateMean(RenderAll(scene, Settings(400, 300, 1), 8), 0).mean, 0);
}

TEST(SelfIntersection, ContactShadowsHold) {
    // A small box on a large ground: what is next to its foot, 0.1 % of its size away, is in its
    // shadow.
    auto scene = std::make_shared<Scene>();
    scene->materials = {Diffuse({0.5f, 0.5f, 0.5f})};
    AddMesh(scene.get(), Quad({-50, 0, 50}, {50, 0, 50}, {50, 0, -50}, {-50, 0, -50}, 0));
    AddMesh(scene.get(), Cube(0), Transform::Translate({0, 1, 0}));
    Light sun;
    sun.type = "directional";
    sun.params.Set("irradiance", std::vector<float>{1, 1, 1});
    sun.to_world = Transform::LookAt({-1, 1, 0}, {0, 0, 0}, {0, 1, 0});
    scene->lights.push_back(sun);
    scene->cameras.push_back(PerspectiveCamera({1.002f, 5, 0}, {1.002f, 0, 0}, 1e-4f, {0, 0, -1}));
    const Film film = RenderAll(scene, Settings(8, 8, 2), 4);
    EXPECT_EQ(EstimateMean(film, 0).mean, 0);
}

TEST(SelfIntersection, InstancesThatShareAMeshShadeLikeCopies) {
    // Above a number of triangles instances are not flattened: both ways give the same picture. The
    // others lie out of sight.
    auto few = std::make_shared<Scene>();
    few->materials = {MetallicRoughness({0.8f, 0.6f, 0.4f}, 0.5f, 0.5f)};
    AddMesh(few.get(), Sphere(0, 24),
            Transform::Translate({-1, 0, 0}) * Transform::Scale({1, 0.5f, -0.8f}));
    few->instances.push_back(
        {0, Transform::Translate({1, 0, 0}) * Transform::Rotate(0, 0.6f, 0, 0.8f)});
    SetEnvironment(few.get(), {1, 0.8f, 0.6f});
    few->lights.push_back(PointLight({3, 4, 5}, {40, 40, 40}));
    few->cameras.push_back(PerspectiveCamera({0, 0, 6}, {0, 0, 0}, 0.6f));
    auto many = std::make_shared<Scene>(*few);
    for (int i = 0; many->TriangleCount() <= 2'100'000; ++i) {
        many->instances.push_back(
            {0, Transform::Translate({1e-3f * static_cast<float>(i), 0, 300})});
    }
    const RenderSettings settings = Settings(32, 24, 4);
    const Film a = RenderAll(few, settings, 16), b = RenderAll(many, settings, 16);
    double difference = 0, sum = 0;
    for (std::size_t i = 0; i < a.pixel_count(); ++i) {
        difference += std::abs(a.Mean(i).y - b.Mean(i).y);
        sum += a.Mean(i).y;
    }
    // The copies out of sight hide a speck of the environment, and hits differ in the last bit.
    EXPECT_LT(difference, 0.01 * sum);
    EXPECT_EQ(b.TotalBadSamples(), 0);
}

}  // namespace
}  // namespace relume::test
