#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/motion.h"
#include "tests/support/lit.h"
#include "tests/support/scenes.h"
#include "worker/render/camera/ray_camera.h"

namespace relume::render {
namespace {

struct Made : test::Lit {
    using Lit::Lit;

    // Along -z from z = 5.
    bool Hits(float x, float y, float time, Hit* hit) const {
        Ray ray;
        ray.origin = {x, y, 5};
        ray.direction = {0, 0, -1};
        ray.time = time;
        Ray shadow = ray;
        shadow.far = 100;
        const bool found = accel.Intersect(ray, hit);
        EXPECT_EQ(found, accel.Occluded(shadow));
        return found;
    }
};

Scene OneMesh(Mesh mesh) {
    Scene scene;
    scene.materials = {test::Diffuse({1, 1, 1})};
    mesh.material = 0;
    test::AddMesh(&scene, std::move(mesh));
    return scene;
}

Mesh SmallQuad() {
    return test::Quad({-0.5f, -0.5f, 0}, {0.5f, -0.5f, 0}, {0.5f, 0.5f, 0}, {-0.5f, 0.5f, 0}, 0);
}

std::vector<Transform> ThreeKeys() {
    return {Transform::Translate({-2, 0, 0}), Transform::Translate({0, 0, 0}),
            Transform::Translate({0, 2, 1})};
}

// The quad on the way of ThreeKeys, as an instance that moves, a mesh that deforms, and both (half
// of the way each).
std::vector<Scene> ThreeWays() {
    std::vector<Scene> scenes;
    scenes.push_back(OneMesh(SmallQuad()));
    scenes.back().instances[0].motion = ThreeKeys();

    Mesh moving = SmallQuad();
    for (const Transform& key : ThreeKeys()) {
        moving.motion.push_back(moving.positions);
        for (Vec3f& p : moving.motion.back()) {
            p = key.Point(p);
        }
    }
    moving.positions = moving.motion.front();
    scenes.push_back(OneMesh(std::move(moving)));

    Mesh half = SmallQuad();
    std::vector<Transform> instance;
    for (const Transform& key : ThreeKeys()) {
        const Vec3f way = key.Point({0, 0, 0}) * 0.5f;
        half.motion.push_back(half.positions);
        for (Vec3f& p : half.motion.back()) {
            p = p + way;
        }
        instance.push_back(Transform::Translate(way));
    }
    half.positions = half.motion.front();
    scenes.push_back(OneMesh(std::move(half)));
    scenes.back().instances[0].motion = instance;
    return scenes;
}

TEST(Motion, ThingsAreWhereTheyAreAtTheRaysTime) {
    for (const Scene& scene : ThreeWays()) {
        const Made made(scene);
        EXPECT_TRUE(made.accel.moves());
        Hit hit;
        EXPECT_TRUE(made.Hits(-2, 0, 0, &hit));
        EXPECT_NEAR(hit.t, 5, 1e-5);
        EXPECT_EQ(hit.time, 0);
        EXPECT_FALSE(made.Hits(0, 0, 0, &hit));
        EXPECT_TRUE(made.Hits(-1, 0, 0.25f, &hit));
        EXPECT_FALSE(made.Hits(-2, 0, 0.25f, &hit));
        EXPECT_TRUE(made.Hits(0, 0, 0.5f, &hit));
        EXPECT_TRUE(made.Hits(0, 1, 0.75f, &hit));
        EXPECT_NEAR(hit.t, 4.5f, 1e-5);
        EXPECT_FALSE(made.Hits(0, 0, 0.99f, &hit));
        EXPECT_TRUE(made.Hits(0, 2, 0.9999f, &hit));
    }
}

TEST(Motion, BoundsCoverAllTimes) {
    for (const Scene& scene : ThreeWays()) {
        const Box3f box = scene.Bounds();
        EXPECT_NEAR(box.lower.x, -2.5f, 1e-6);
        EXPECT_NEAR(box.upper.y, 2.5f, 1e-6);
        EXPECT_NEAR(box.upper.z, 1, 1e-6);
    }
}

// A rotation of `turn` radians about y, as keys of the loader's choice.
std::vector<Transform> Turning(float turn) {
    SampledTransform samples;
    for (const double t : SampleTimes(0, 1)) {
        const float half = turn * static_cast<float>(t) / 2;
        samples.push_back(Transform::Rotate(0, std::sin(half), 0, std::cos(half)));
    }
    return MotionKeys(samples);
}

// Mean normals of a picture of a sphere of radius 1.
std::vector<Vec3f> Normals(const Scene& scene) {
    auto shared = std::make_shared<Scene>(scene);
    shared->cameras = {test::PerspectiveCamera({0, 0, 5}, {0, 0, 0}, 0.35f)};
    test::SetEnvironment(shared.get(), {1, 1, 1});
    const Film film = test::RenderAll(shared, test::Settings(16, 16, 2), 64);
    std::vector<Vec3f> normals;
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        Vec3f n;
        for (int c = 0; c < 3; ++c) {
            n[c] = (film.Plane(kFeatureMeanA + (kNormalX + c))[i] +
                    film.Plane(kFeatureMeanB + (kNormalX + c))[i]) /
                   2;
        }
        normals.push_back(n);
    }
    return normals;
}

TEST(Motion, ATurningSphereLooksAsIfItStoodStill) {
    const Mesh sphere = test::Sphere(0, 32);
    const std::vector<Vec3f> still = Normals(OneMesh(sphere));
    Scene turning = OneMesh(sphere);
    turning.instances[0].motion = Turning(1.5f);
    Mesh turned = sphere;
    for (const Transform& key : Turning(1.5f)) {
        turned.motion.push_back(sphere.positions);
        for (Vec3f& p : turned.motion.back()) {
            p = key.Point(p);
        }
    }
    Mesh nested = sphere;
    nested.motion = {sphere.positions, sphere.positions};
    Scene both = OneMesh(nested);
    both.instances[0].motion = Turning(1.5f);
    for (const Scene& scene : {turning, OneMesh(turned), both}) {
        const std::vector<Vec3f> normals = Normals(scene);
        for (std::size_t i = 0; i < normals.size(); ++i) {
            // Facets and rims differ a little.
            EXPECT_LT(Length(normals[i] - still[i]), 0.05f) << i;
        }
    }
}

TEST(Motion, AMirroredThingKeepsItsFrontWhileItMoves) {
    for (const bool both : {false, true}) {
        Mesh quad = SmallQuad();
        if (both) {
            quad.motion = {quad.positions, quad.positions};
        }
        Scene scene = OneMesh(quad);
        const Transform mirror = Transform::Scale({-1, 1, 1});
        scene.instances[0].motion = {mirror, Transform::Translate({0, 0, 1}) * mirror};
        const Made made(scene);
        Hit hit;
        ASSERT_TRUE(made.Hits(0, 0, 0.5f, &hit));
        EXPECT_NEAR(hit.normal.z, 1, 1e-6) << both;
    }
}

TEST(Motion, WhatStandsStillKeepsItsBits) {
    const auto settings = test::Settings(24, 24, 5);
    const auto still = test::CornellBox();
    // Beside the box, where no ray goes.
    auto moves = test::CornellBox();
    test::AddMesh(moves.get(), SmallQuad(), Transform::Translate({50, 0, 0}));
    moves->instances.back().motion = {Transform::Translate({50, 0, 0}),
                                      Transform::Translate({51, 0, 0})};
    const Film a = test::RenderAll(still, settings, 8), b = test::RenderAll(moves, settings, 8);
    for (int c = kMeanA; c < kFeatureMeanA; ++c) {
        EXPECT_TRUE(std::equal(a.Plane(c).begin(), a.Plane(c).end(), b.Plane(c).begin())) << c;
    }
    EXPECT_FALSE(Made(*still).accel.moves());
    EXPECT_TRUE(Made(*moves).accel.moves());
}

TEST(Motion, TilesDoNotShow) {
    auto scene = test::CornellBox();
    for (Instance& instance : scene->instances) {
        instance.motion = {instance.to_world,
                           Transform::Translate({0.05f, 0.02f, 0}) * instance.to_world};
    }
    scene->cameras[0].motion = {scene->cameras[0].to_world,
                                Transform::Translate({0, 0.1f, 0}) * scene->cameras[0].to_world};
    const auto settings = test::Settings(24, 20, 5);
    const Film a = test::RenderAll(scene, settings, 6, 32),
               b = test::RenderAll(scene, settings, 6, 7);
    for (int c = 0; c < kFilmChannelCount; ++c) {
        EXPECT_TRUE(std::equal(a.Plane(c).begin(), a.Plane(c).end(), b.Plane(c).begin())) << c;
    }
}

TEST(Motion, CameraTurnsAndGoes) {
    Camera camera = test::PerspectiveCamera({0, 0, 4}, {0, 0, 0}, 0.8f);
    // A quarter turn to the left, in 33 keys, while it rises by 1.
    const std::vector<Transform> turning = Turning(kPi / 2);
    for (std::size_t k = 0; k < turning.size(); ++k) {
        const float t = static_cast<float>(k) / static_cast<float>(turning.size() - 1);
        camera.motion.push_back(Transform::Translate({0, t, 4}) * turning[k]);
    }
    const RayCamera c = CompileCamera(camera, test::Settings(100, 100, 4));
    const CameraRay first = c.Generate({30, 80}, {});
    const auto expect_near = [](Vec3f a, Vec3f b) { EXPECT_LT(Length(a - b), 2e-3f); };
    expect_near(c.MoveTo(0, first).direction, first.direction);
    const CameraRay half = c.MoveTo(0.5f, first), whole = c.MoveTo(1, first);
    expect_near(half.origin, {0, 0.5f, 4});
    const float s = std::sqrt(0.5f);
    const Vec3f d = first.direction;
    expect_near(half.direction, {s * d.x + s * d.z, d.y, s * d.z - s * d.x});
    expect_near(whole.direction, {d.z, d.y, -d.x});
    EXPECT_NEAR(Length(half.direction), 1, 1e-6f);
}

}  // namespace
}  // namespace relume::render
