#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "tests/support/scenes.h"

namespace relume::test {
namespace {

// A diffuse floor of albedo rho, seen straight from above through a narrow camera at the origin's
// spot.
std::shared_ptr<Scene> Floor(float rho) {
    auto scene = std::make_shared<Scene>();
    scene->materials = {Diffuse({rho, rho, rho})};
    AddMesh(scene.get(), Quad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}, 0));
    scene->cameras.push_back(PerspectiveCamera({0, 10, 0}, {0, 0, 0}, 1e-3f, {0, 0, -1}));
    return scene;
}

void ExpectRadiance(const std::shared_ptr<Scene>& scene, std::uint32_t spp, Rgb expected,
                    double relative = 1e-4) {
    const Film film = RenderAll(scene, Settings(16, 16, 2), spp);
    for (int c = 0; c < 3; ++c) {
        const Estimate e = EstimateMean(film, c);
        EXPECT_NEAR(e.mean, expected[c], 3 * e.standard_error + relative * expected[c]);
        EXPECT_LT(e.standard_error, 0.01 * expected[c]);
    }
}

TEST(DirectLight, PointLightOverFloor) {
    // rho / pi * I cos / d^2 at distance (1, 2, 0): cos = 2 / sqrt 5.
    auto scene = Floor(0.6f);
    scene->lights.push_back(PointLight({1, 2, 0}, {3, 6, 9}));
    const float e = 0.6f / kPi * (2 / std::sqrt(5.0f)) / 5;
    ExpectRadiance(scene, 4, {3 * e, 6 * e, 9 * e});
}

TEST(DirectLight, DirectionalAndSpotLights) {
    auto scene = Floor(0.5f);
    Light sun;
    sun.type = "directional";
    sun.params.Set("irradiance", std::vector<float>{2, 2, 2});
    // Shines along -z of its node: down, slanted by 60 degrees from the vertical.
    sun.to_world = Transform::LookAt({std::sqrt(3.0f), 1, 0}, {0, 0, 0}, {0, 1, 0});
    scene->lights.push_back(sun);
    ExpectRadiance(scene, 4, Rgb{1, 1, 1} * (0.5f / kPi * 2 * 0.5f));

    scene->lights.clear();
    Light spot;
    spot.type = "spot";
    spot.params.Set("intensity", std::vector<float>{8, 8, 8});
    spot.params.Set("inner_angle", 0.2f);
    spot.params.Set("outer_angle", 0.4f);
    spot.to_world = Transform::LookAt({0, 2, 0}, {0, 0, 0}, {1, 0, 0});
    scene->lights.push_back(spot);
    ExpectRadiance(scene, 4, Rgb{1, 1, 1} * (0.5f / kPi * 8 / 4));

    // Seen at 0.3 radians from the axis: between the cones, the square of the linear ramp of the
    // cosine.
    scene->lights[0].to_world = Transform::LookAt({0, 2, 0}, {2 * std::tan(0.3f), 0, 0}, {1, 0, 0});
    const float ramp = (std::cos(0.3f) - std::cos(0.4f)) / (std::cos(0.2f) - std::cos(0.4f));
    ExpectRadiance(scene, 4, Rgb{1, 1, 1} * (0.5f / kPi * 8 / 4 * ramp * ramp));
}

TEST(DirectLight, FalloffsOfSpotLights) {
    auto scene = Floor(0.5f);
    Light spot;
    spot.type = "spot";
    spot.params.Set("intensity", std::vector<float>{8, 8, 8});
    spot.params.Set("inner_angle", 0.2f);
    spot.params.Set("outer_angle", 0.4f);
    spot.to_world = Transform::LookAt({0, 2, 0}, {2 * std::tan(0.3f), 0, 0}, {1, 0, 0});
    const float t = (std::cos(0.3f) - std::cos(0.4f)) / (std::cos(0.2f) - std::cos(0.4f));
    const struct {
        const char* name;
        float falloff;
    } cases[] = {{"gltf", t * t}, {"smoothstep", t * t * (3 - 2 * t)}, {"quartic", t * t * t * t}};
    for (const auto& c : cases) {
        spot.params.Set("falloff", std::string(c.name));
        scene->lights = {spot};
        ExpectRadiance(scene, 4, Rgb{1, 1, 1} * (0.5f / kPi * 8 / 4 * c.falloff));
    }
    // Wider than half of all directions: it shines backwards too.
    spot.params.Set("outer_angle", 3.0f);
    spot.params.Set("falloff", std::string("gltf"));
    spot.to_world = Transform::LookAt({0, 2, 0}, {2, 3, 0}, {0, 0, 1});
    scene->lights = {spot};
    const float cosine = -1 / std::sqrt(5.0f);  // between the axis and straight down
    const float wide = (cosine - std::cos(3.0f)) / (std::cos(0.2f) - std::cos(3.0f));
    ExpectRadiance(scene, 4, Rgb{1, 1, 1} * (0.5f / kPi * 8 / 4 * wide * wide));
}

TEST(DirectLight, GoniometricLightsShineAsTheirPictureSays) {
    // 4 x 3 texels, each of its own grey.
    auto scene = Floor(0.5f);
    SceneImage image;
    image.name = "lamp";
    image.width = 4;
    image.height = 3;
    image.channels = 3;
    for (int i = 0; i < 12; ++i) {
        image.floats.insert(image.floats.end(), 3, static_cast<float>(i + 1));
    }
    scene->images.push_back(image);
    Light light;
    light.type = "goniometric";
    light.params.Set("intensity", std::vector<float>{2, 4, 6});
    light.params.Set("image", 0.0f);
    // Local +x is below: u = 0.5 + atan2(1, 0) / 2 pi = 3/4, v = 1/2: between texels 2 and 3 of the
    // row in the middle, 7 and 8.
    light.to_world = Transform({0, 0, 1, 0, -1, 0, 0, 2, 0, -1, 0, 0});
    scene->lights.push_back(light);
    const float e = 0.5f / kPi / 4 * 7.5f;
    ExpectRadiance(scene, 4, {2 * e, 4 * e, 6 * e}, 1e-3);

    scene->lights[0].params.Set("image", 3.0f);
    EXPECT_THROW(RenderAll(scene, Settings(4, 4, 2), 1), Error);
}

// Form factor from a horizontal patch to a parallel rectangle a x b at height h with a corner above
// the patch.
double CornerFormFactor(double a, double b, double h) {
    const double x = a / h, y = b / h;
    const double rx = std::sqrt(1 + x * x), ry = std::sqrt(1 + y * y);
    return (x / rx * std::atan(y / rx) + y / ry * std::atan(x / ry)) / (2 * M_PI);
}

std::shared_ptr<Scene> UnderRectangle(bool double_sided, bool face_up) {
    auto scene = Floor(0.8f);
    Material light = Diffuse({0, 0, 0}, {5, 5, 5});
    light.params.Set("double_sided", double_sided);
    scene->materials.push_back(light);
    // Off the camera's way: the patch lies below one corner, a hair beside it.
    if (face_up) {
        AddMesh(scene.get(), Quad({0.02f, 1, 3}, {2, 1, 3}, {2, 1, 0}, {0.02f, 1, 0}, 1));
    } else {
        AddMesh(scene.get(), Quad({0.02f, 1, 0}, {2, 1, 0}, {2, 1, 3}, {0.02f, 1, 3}, 1));
    }
    return scene;
}

TEST(DirectLight, RectangleByFormFactor) {
    // A rectangle from x 0.02 to 2: the difference of two with corners above the patch.
    const double factor = CornerFormFactor(2, 3, 1) - CornerFormFactor(0.02, 3, 1);
    const float expected = static_cast<float>(0.8 * 5 * factor);
    ExpectRadiance(UnderRectangle(false, false), 512, {expected, expected, expected}, 1e-3);
    ExpectRadiance(UnderRectangle(true, true), 512, {expected, expected, expected}, 1e-3);
}

TEST(DirectLight, BackOfOneSidedLightIsDark) {
    auto scene = UnderRectangle(false, true);
    RenderSettings settings = Settings(8, 8, 2);
    const Film film = RenderAll(scene, settings, 16);
    EXPECT_EQ(EstimateMean(film, 0).mean, 0);
}

TEST(DirectLight, UniformEnvironmentOverFloor) {
    auto scene = Floor(0.8f);
    SetEnvironment(scene.get(), {1, 2, 3});
    ExpectRadiance(scene, 64, {0.8f, 1.6f, 2.4f}, 1e-3);
}

TEST(DirectLight, TexturedEmissionHasItsMean) {
    auto scene = UnderRectangle(false, false);
    // Left half black, right half white: of the whole, minus the left half.
    scene->materials[1].params.Set(
        "emissive_texture",
        static_cast<float>(AddTexture(scene.get(), 2, 1, 3,
                                      std::vector<std::uint8_t>{0, 0, 0, 255, 255, 255}, false)));
    scene->textures[0].nearest = true;
    const double factor = CornerFormFactor(2, 3, 1) - CornerFormFactor(1.01, 3, 1);
    const float expected = static_cast<float>(0.8 * 5 * factor);
    ExpectRadiance(scene, 1024, {expected, expected, expected}, 2e-3);
}

TEST(DirectLight, MaskedPartOfALightDoesNotShine) {
    // The left half is cut out; the same as if it were black, whoever finds the light.
    auto scene = UnderRectangle(false, false);
    const int cut =
        AddTexture(scene.get(), 2, 1, 4,
                   std::vector<std::uint8_t>{255, 255, 255, 0, 255, 255, 255, 255}, false);
    scene->textures[0].nearest = true;
    scene->materials[1].params.Set("base_color_texture", static_cast<float>(cut));
    scene->materials[1].params.Set("alpha_mode", "mask");
    const double factor = CornerFormFactor(2, 3, 1) - CornerFormFactor(1.01, 3, 1);
    const float expected = static_cast<float>(0.8 * 5 * factor);
    ExpectRadiance(scene, 1024, {expected, expected, expected}, 2e-3);
}

TEST(DirectLight, FarFromTheOriginIsTheSame) {
    // All that is written in floats is coarse there: the light's place by 1e-3 of its height.
    auto scene = UnderRectangle(false, false);
    for (Instance& instance : scene->instances) {
        instance.to_world = Transform::Translate({3000, 2000, -4000});
    }
    scene->cameras[0].to_world =
        Transform::LookAt({3000, 2010, -4000}, {3000, 2000, -4000}, {0, 0, -1});
    const double factor = CornerFormFactor(2, 3, 1) - CornerFormFactor(0.02, 3, 1);
    const float expected = static_cast<float>(0.8 * 5 * factor);
    ExpectRadiance(scene, 512, {expected, expected, expected}, 0.02);
}

TEST(DirectLight, LightSeenThroughSlabOfGlassKeepsItsRadiance) {
    // Straight through a slab: two crossings at normal incidence, with reflections back and forth
    // inside: T = (1 - R) / (1 + R), R = 0.04. Scaling by eta^2 cancels.
    auto scene = std::make_shared<Scene>();
    scene->materials = {Diffuse({0, 0, 0}, {2, 2, 2}), Dielectric(1.5f, 0)};
    AddMesh(scene.get(), Quad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}, 0));
    AddMesh(scene.get(), Cube(1), Transform::Translate({0, 5, 0}) * Transform::Scale({2, 1, 2}));
    scene->cameras.push_back(PerspectiveCamera({0, 10, 0}, {0, 0, 0}, 1e-3f, {0, 0, -1}));
    const Film film = RenderAll(scene, Settings(16, 16, 32), 64);
    const Estimate e = EstimateMean(film, 1);
    EXPECT_NEAR(e.mean, 2 * 0.96 / 1.04, 3 * e.standard_error + 1e-4);
}

TEST(DirectLight, InsideGlassRadianceIsScaledByIndexSquared) {
    // A camera inside glass sees the light outside brighter by the index squared (Veach 1997, 5.2).
    auto scene = std::make_shared<Scene>();
    scene->materials = {Diffuse({0, 0, 0}, {2, 2, 2}), Dielectric(1.5f, 0)};
    AddMesh(scene.get(), Quad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}, 0));
    AddMesh(scene.get(), Cube(1), Transform::Translate({0, 5, 0}) * Transform::Scale({2, 1, 2}));
    scene->cameras.push_back(PerspectiveCamera({0, 5, 0}, {0, 0, 0}, 1e-3f, {0, 0, -1}));
    const Film film = RenderAll(scene, Settings(16, 16, 2), 256);
    const Estimate e = EstimateMean(film, 1);
    EXPECT_NEAR(e.mean, 2 * 0.96 * 1.5 * 1.5, 3 * e.standard_error + 1e-4);
}

}  // namespace
}  // namespace relume::test
