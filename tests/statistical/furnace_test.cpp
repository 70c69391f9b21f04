#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "tests/support/scenes.h"

namespace relume::test {
namespace {

// A closed box around the camera, every wall diffuse and shining.
std::shared_ptr<Scene> Furnace(float albedo, float emission) {
    auto scene = std::make_shared<Scene>();
    scene->materials = {Diffuse({albedo, albedo, albedo}, {emission, emission, emission})};
    AddMesh(scene.get(), Cube(0, true));
    scene->cameras.push_back(PerspectiveCamera({0.1f, 0.2f, 0.3f}, {0.9f, -0.3f, -1}, 1.2f));
    return scene;
}

void ExpectRadiance(std::shared_ptr<const Scene> scene, int depth, std::uint32_t spp,
                    double expected, double bias = 0) {
    const Film film = RenderAll(std::move(scene), Settings(32, 24, depth), spp);
    for (int c = 0; c < 3; ++c) {
        const Estimate e = EstimateMean(film, c);
        EXPECT_NEAR(e.mean, expected, 3 * e.standard_error + bias + 1e-5 * expected)
            << "standard error " << e.standard_error;
        EXPECT_LT(e.standard_error, 0.02 * expected);
    }
    EXPECT_EQ(film.TotalBadSamples(), 0);
}

TEST(WhiteFurnace, ClosedBoxOfAlbedoOne) {
    // Nothing is lost: each segment of a path meets the same emission.
    ExpectRadiance(Furnace(1, 0.5f), 1, 4, 0.5);
    ExpectRadiance(Furnace(1, 0.5f), 2, 128, 1.0);
    ExpectRadiance(Furnace(1, 0.5f), 8, 64, 4.0);
}

TEST(WhiteFurnace, ClosedBoxOfAnyAlbedo) {
    // The geometric series: what is beyond 100 segments is under 1e-15 at these albedos.
    ExpectRadiance(Furnace(0.5f, 1), 100, 64, 2.0);
    ExpectRadiance(Furnace(0.7f, 0.3f), 100, 64, 1.0);
}

// An object in a uniform environment of radiance 1 reflects what its albedo is.
std::shared_ptr<Scene> InUniformLight(Material material) {
    auto scene = std::make_shared<Scene>();
    scene->materials = {std::move(material)};
    AddMesh(scene.get(), Sphere(0, 128));
    SetEnvironment(scene.get(), {1, 1, 1});
    // Sees the sphere alone.
    scene->cameras.push_back(PerspectiveCamera({0, 0, 4}, {0, 0, 0}, 0.3f));
    return scene;
}

TEST(WhiteFurnace, WhiteSphereVanishes) {
    ExpectRadiance(InUniformLight(Diffuse({1, 1, 1})), 16, 32, 1.0, 2e-3);
    for (const float roughness : {0.0f, 0.3f, 0.8f}) {
        for (const float metallic : {0.0f, 1.0f}) {
            // Up to the grid of the albedo table, and to what shading normals lose at the rim.
            ExpectRadiance(InUniformLight(MetallicRoughness({1, 1, 1}, metallic, roughness)), 16,
                           32, 1.0, 0.015);
        }
    }
    // Smooth glass: radiance scaling cancels between going in and coming out.
    ExpectRadiance(InUniformLight(Dielectric(1.5f, 0)), 64, 32, 1.0, 0.01);
}

Material Make(const char* type, std::vector<std::pair<const char*, std::vector<float>>> params) {
    Material material{type, type, {}, type};
    for (auto& [name, value] : params) {
        material.params.Set(name, value);
    }
    return material;
}

TEST(WhiteFurnace, EveryWhiteMaterialVanishes) {
    const std::vector<float> white{1, 1, 1};
    for (const float alpha : {0.0f, 0.1f, 0.4f}) {
        ExpectRadiance(InUniformLight(Make("coated_diffuse", {{"alpha_u", {alpha}}})), 16, 32, 1.0,
                       0.015);
    }
    ExpectRadiance(InUniformLight(Make("conductor", {{"reflectance", white}})), 16, 32, 1.0, 2e-3);
    ExpectRadiance(InUniformLight(Make("thin_dielectric", {})), 64, 32, 1.0, 2e-3);
    ExpectRadiance(
        InUniformLight(Make("diffuse_transmission", {{"base_color", {0.4f, 0.4f, 0.4f}},
                                                     {"transmittance", {0.6f, 0.6f, 0.6f}}})),
        100, 64, 1.0, 4e-3);
    // A mixture of what vanishes vanishes.
    auto mixed =
        InUniformLight(Make("mix", {{"material_a", {1}}, {"material_b", {2}}, {"amount", {0.3f}}}));
    auto scene = std::make_shared<Scene>(*mixed);
    scene->materials.push_back(Diffuse({1, 1, 1}));
    scene->materials.push_back(Make("coated_diffuse", {}));
    ExpectRadiance(scene, 16, 32, 1.0, 0.01);
}

TEST(WhiteFurnace, LayersTakeAtMostWhatTheyGive) {
    for (const float metallic : {0.0f, 1.0f}) {
        for (const float coat : {0.0f, 1.0f}) {
            for (const float sheen : {0.0f, 1.0f}) {
                Material m = MetallicRoughness({1, 1, 1}, metallic, 0.5f);
                m.params.Set("clearcoat", coat);
                m.params.Set("clearcoat_roughness", 0.3f);
                m.params.Set("sheen_color", std::vector<float>{sheen, sheen, sheen});
                m.params.Set("sheen_roughness", 0.5f);
                const Film film = RenderAll(InUniformLight(m), Settings(32, 24, 16), 64);
                const Estimate e = EstimateMean(film, 1);
                EXPECT_LT(e.mean, 1.01 + 3 * e.standard_error) << coat << sheen << metallic;
                EXPECT_GT(e.mean, 0.8) << coat << sheen << metallic;
            }
        }
    }
}

TEST(WhiteFurnace, RoughGlassGainsNothing) {
    for (const float roughness : {0.2f, 0.5f, 1.0f}) {
        const Film film =
            RenderAll(InUniformLight(Dielectric(1.5f, roughness)), Settings(32, 24, 64), 32);
        const Estimate e = EstimateMean(film, 1);
        EXPECT_LT(e.mean, 1 + 3 * e.standard_error);
        EXPECT_GT(e.mean, 0.3);  // single scattering loses that much
    }
}

}  // namespace
}  // namespace relume::test
