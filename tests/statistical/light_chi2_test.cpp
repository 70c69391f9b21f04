#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/film/moments.h"
#include "core/math/frame.h"
#include "tests/support/chi2.h"
#include "tests/support/lit.h"
#include "tests/support/scenes.h"
#include "worker/render/sampler/warp.h"

namespace relume::render {
namespace {

constexpr int kTests = 6;

struct Lit : test::Lit {
    using test::Lit::Lit;

    // Samples and density as the integrator uses them: Sample here, and the density of what a ray
    // hits there.
    double ChiSquare(Vec3f p, int samples) const {
        return test::TestSphereSampler(
            {[&](Vec2f u, float choice, Vec3f* d) {
                 const auto s = lights.Sample({p}, static_cast<std::uint32_t>(choice * 0x1p32), u);
                 if (s) {
                     *d = s->wi;
                 }
                 return s.has_value();
             },
             [&](Vec3f d) { return Density(p, d); }},
            samples);
    }

    double Density(Vec3f p, Vec3f d) const {
        float pdf = 0;
        lights.Environment(d, &pdf);
        Ray ray;
        ray.origin = p;
        ray.direction = Normalize(d);
        double sum = pdf;
        // Lights behind lights count too: sampling knows no visibility.
        Hit hit;
        float travelled = 0;
        while (accel.Intersect(ray, &hit)) {
            const Object& object = accel.objects()[hit.object];
            travelled += hit.t;
            if (object.first_light >= 0 && Dot(hit.normal, ray.direction) < 0) {
                sum +=
                    lights.AreaPdf({p}, object, hit.triangle, travelled, ray.direction, hit.normal);
            }
            ray.origin = ray.origin + ray.direction * (hit.t + 1e-4f);
            travelled += 1e-4f;
        }
        return sum;
    }
};

Scene EnvironmentScene(bool sun) {
    Scene scene;
    scene.materials = {test::Diffuse({0.5f, 0.5f, 0.5f})};
    test::AddMesh(&scene, test::Quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, 0));
    const int width = 16, height = 8;
    std::mt19937 random(9);
    std::uniform_real_distribution<float> uniform(0, 1);
    std::vector<float> pixels;
    for (int i = 0; i < width * height; ++i) {
        const float v = uniform(random) < 0.3f ? 0 : uniform(random);
        pixels.insert(pixels.end(), {v, 0.5f * v, 0.7f * v});
    }
    if (sun) {
        std::fill_n(pixels.begin() + 3 * (2 * 16 + 5), 3, 50.0f);
    }
    test::AddTexture(&scene, width, height, 3, pixels);
    auto environment = std::make_shared<Environment>();
    environment->image = 0;
    environment->to_world = Transform::Rotate(0.36f, 0.48f, 0, 0.8f);
    scene.environment = environment;
    return scene;
}

TEST(LightChi2, EnvironmentMap) {
    const Lit lit(EnvironmentScene(false));
    EXPECT_GT(lit.ChiSquare({0, 0, 5}, 200000), test::SignificanceOf(kTests));
}

TEST(LightChi2, EnvironmentMapWithSun) {
    const Lit lit(EnvironmentScene(true));
    EXPECT_GT(lit.ChiSquare({0, 0, 5}, 200000), test::SignificanceOf(kTests));
}

TEST(LightChi2, MixOfAreaLightsAndEnvironment) {
    // Large lights around the point: cells of the sphere are crossed by few edges, which quadrature
    // smears.
    Scene scene = EnvironmentScene(false);
    scene.materials.push_back(test::Diffuse({0, 0, 0}, {1, 2, 3}));
    scene.materials.push_back(test::Diffuse({0, 0, 0}, {4, 1, 1}));
    test::AddMesh(&scene, test::Sphere(1, 24),
                  Transform::Translate({0, 3, 5}) * Transform::Scale({1.5f, 1, 1.5f}));
    test::AddMesh(&scene, test::Cube(2, true),
                  Transform::Translate({0, 0, 5}) * Transform::Scale({6, 7, 8}));
    const Lit lit(scene);
    EXPECT_GT(lit.ChiSquare({0.2f, 0.1f, 5}, 20000), test::SignificanceOf(kTests));
}

TEST(LightChi2, MirroredEnvironmentMap) {
    Scene scene = EnvironmentScene(false);
    Environment mirrored = *scene.environment;
    mirrored.to_world = mirrored.to_world * Transform::Scale({1, 1, -1});
    scene.environment = std::make_shared<Environment>(mirrored);
    EXPECT_GT(Lit(scene).ChiSquare({0, 0, 5}, 200000), test::SignificanceOf(kTests));
}

TEST(LightChi2, LargeMapIsDrawnFromByStepsOfTheTable) {
    // 600 x 300 texels are too many for one level of the table, and no multiple of 4.
    Scene scene = EnvironmentScene(false);
    const int width = 602, height = 301;
    std::mt19937 random(4);
    std::uniform_real_distribution<float> uniform(0, 1);
    std::vector<float> pixels;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const float patch = ((x / 70 + y / 60) & 1) != 0 ? 0.0f : 1.0f;
            pixels.insert(pixels.end(), 3, patch * (0.5f + uniform(random)));
        }
    }
    auto environment = std::make_shared<Environment>(*scene.environment);
    environment->image = 1;
    scene.environment = environment;
    test::AddTexture(&scene, width, height, 3, pixels);
    EXPECT_GT(Lit(scene).ChiSquare({0, 0, 5}, 100000), test::SignificanceOf(kTests));
}

TEST(LightChi2, TreeOfManyNearAndFarLights) {
    Scene scene;
    scene.materials = {test::Diffuse({0, 0, 0}, {1, 2, 3}), test::Diffuse({0, 0, 0}, {6, 1, 1})};
    scene.materials[1].params.Set("double_sided", true);
    std::mt19937 random(8);
    std::uniform_real_distribution<float> uniform(-1, 1);
    for (int i = 0; i < 30; ++i) {
        const Vec3f middle =
            Normalize({uniform(random), uniform(random), uniform(random)}) * (2 + i * 0.2f);
        const Frame f = Frame::FromZ(
            Normalize(-middle + Vec3f{uniform(random), uniform(random), uniform(random)}));
        const Vec3f u = f.x * 1.5f, v = f.y * (i % 3 == 0 ? 2.0f : 1.0f);
        test::AddMesh(&scene,
                      test::Quad(middle - u - v, middle + u - v, middle + u + v,
                                 i % 2 == 0 ? middle - u + v : middle - u * 0.5f + v, i % 2));
    }
    EXPECT_GT(Lit(scene).ChiSquare({0.1f, 0.2f, 0}, 20000), test::SignificanceOf(kTests));
}

// What Sample says of a direction is what a ray in that direction finds.
TEST(LightSet, SampleAndAreaPdfAgree) {
    Scene scene;
    scene.materials = {test::Diffuse({0, 0, 0}, {1, 2, 3}), test::Diffuse({0, 0, 0}, {6, 1, 1})};
    scene.materials[1].params.Set("double_sided", true);
    test::AddMesh(&scene, test::Quad({-1, -1, 2}, {-1, 1, 2}, {1, 1, 2}, {1, -1, 2}, 0));
    test::AddMesh(&scene, test::Sphere(0, 8), Transform::Translate({3, 0, 1}));
    test::AddMesh(&scene, test::Quad({-5, -1, 0}, {-5, 1, 0}, {-5, 1, 1}, {-5, -1, 1}, 0),
                  Transform::Scale({1, -1, 1}));
    test::AddMesh(&scene, test::Quad({-2, 4, 0}, {-2, 4, 3}, {2, 4, 3}, {3, 4, 0}, 1));
    test::SetEnvironment(&scene, {0.3f, 0.3f, 0.3f});
    const test::Lit lit(scene);
    std::mt19937 random(12);
    std::uniform_real_distribution<float> uniform(0, 0.999999f);
    int found = 0, missed = 0, unequal = 0;
    for (int i = 0; i < 20000; ++i) {
        const Vec3f p{4 * uniform(random) - 2, 4 * uniform(random) - 2, uniform(random)};
        const LightReceiver at{p, SampleSphere({uniform(random), uniform(random)}), i % 2 == 0};
        const auto s = lit.lights.Sample(at, static_cast<std::uint32_t>(random()),
                                         {uniform(random), uniform(random)});
        if (!s || std::isinf(s->distance)) {
            continue;
        }
        Ray ray;
        ray.origin = p;
        ray.direction = s->wi;
        Hit hit;
        if (!lit.accel.Intersect(ray, &hit) || std::abs(hit.t - s->distance) > 1e-3f * hit.t) {
            ++missed;  // behind another, or at an edge
            continue;
        }
        ++found;
        const float pdf = lit.lights.AreaPdf(at, lit.accel.objects()[hit.object], hit.triangle,
                                             hit.t, s->wi, hit.normal);
        unequal += std::abs(pdf - s->pdf) > 2e-3f * s->pdf ? 1 : 0;
    }
    EXPECT_GT(found, 5 * missed);
    EXPECT_LE(unequal, found / 2000);  // rays that meet the neighbour along an edge
}

TEST(EnvironmentLight, SampleAndRadianceAgree) {
    for (const bool mirrored : {false, true}) {
        const Scene scene = EnvironmentScene(true);
        Environment environment = *scene.environment;
        if (mirrored) {
            environment.to_world = environment.to_world * Transform::Scale({-1, 1, 1});
        }
        const EnvironmentLight light(scene, environment);
        std::mt19937 random(9);
        std::uniform_real_distribution<float> uniform(0, 0.999999f);
        for (int i = 0; i < 5000; ++i) {
            LightSample s;
            if (!light.Sample({uniform(random), uniform(random)}, &s)) {
                continue;
            }
            float pdf = 0;
            const Rgb radiance = light.Radiance(s.wi, &pdf);
            // From direction to map and back: a few 1e-7 of the map's width, times the slope of the
            // tents.
            EXPECT_NEAR(pdf, s.pdf, 1e-3f * s.pdf + 1e-5f);
            EXPECT_NEAR(radiance.x, s.radiance.x, 1e-3f * s.radiance.x + 1e-4f);
        }
    }
}

TEST(EnvironmentLight, EstimatesItsOwnIrradiance) {
    // Mean of radiance / pdf over samples is the integral over the sphere.
    const Scene scene = EnvironmentScene(true);
    const EnvironmentLight light(scene, *scene.environment);
    std::mt19937 random(10);
    std::uniform_real_distribution<float> uniform(0, 0.999999f);
    Moments sampled, uniformly;
    for (int i = 0; i < 200000; ++i) {
        LightSample s;
        const bool lit = light.Sample({uniform(random), uniform(random)}, &s);
        sampled.Add(lit ? s.radiance.y / s.pdf : 0);
        uniformly.Add(light.Radiance(SampleSphere({uniform(random), uniform(random)}), nullptr).y *
                      4 * kPi);
    }
    const double error = std::sqrt(sampled.MeanVariance() + uniformly.MeanVariance());
    EXPECT_NEAR(sampled.mean, uniformly.mean, 3 * error);
    EXPECT_LT(sampled.SampleVariance(), 0.2 * uniformly.SampleVariance());
}

}  // namespace
}  // namespace relume::render
