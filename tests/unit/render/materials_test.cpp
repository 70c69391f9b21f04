#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "tests/support/lit.h"
#include "tests/support/scenes.h"
#include "worker/render/accel/surface.h"

namespace relume::test {
namespace {

using render::CompileMaterials;

Material Make(const char* type, std::vector<std::pair<const char*, std::vector<float>>> params) {
    Material material{type, type, {}, type};
    for (auto& [name, value] : params) {
        material.params.Set(name, value);
    }
    return material;
}

std::string ErrorOf(std::vector<Material> materials) {
    Scene scene;
    scene.materials = std::move(materials);
    try {
        CompileMaterials(scene);
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

TEST(Materials, WrongParametersAreNamed) {
    EXPECT_NE(ErrorOf({Make("mix", {{"material_a", {0}}, {"material_b", {0}}})})
                  .find("mix: a mix contains itself"),
              std::string::npos);
    EXPECT_NE(
        ErrorOf({Make("mix", {{"material_a", {0}}, {"material_b", {7}}})}).find("contains itself"),
        std::string::npos);
    EXPECT_NE(ErrorOf({Diffuse({1, 1, 1}), Make("mix", {{"material_a", {0}}, {"material_b", {7}}})})
                  .find("material 7, but there are 2"),
              std::string::npos);
    EXPECT_NE(ErrorOf({Make("conductor", {{"eta", {1, 1, 1}}, {"reflectance", {1, 1, 1}}})})
                  .find("either eta and k or reflectance"),
              std::string::npos);
    EXPECT_NE(ErrorOf({Make("coated_diffuse", {{"alpha_u", {1.5f}}})}).find("alpha_u"),
              std::string::npos);
    EXPECT_NE(ErrorOf({Make("thin_dielectric", {{"tint", {1, 1, 1}}})}).find("tint"),
              std::string::npos);
    EXPECT_EQ(ErrorOf({Make("diffuse", {{"sigma", {20}}})}), "");
}

double Seen(const std::shared_ptr<Scene>& scene, int channel, std::uint32_t spp = 64,
            int depth = 8) {
    return EstimateMean(RenderAll(scene, Settings(8, 8, depth), spp), channel).mean;
}

// A shining wall behind whatever stands before it, seen straight on from +z.
std::shared_ptr<Scene> BeforeShiningWall(Material material) {
    auto scene = std::make_shared<Scene>();
    scene->materials = {Diffuse({0, 0, 0}, {1, 1, 1}), std::move(material)};
    AddMesh(scene.get(), Quad({-9, -9, -3}, {9, -9, -3}, {9, 9, -3}, {-9, 9, -3}, 0));
    scene->cameras.push_back(PerspectiveCamera({0, 0, 9}, {0, 0, 0}, 1e-3f));
    return scene;
}

TEST(Materials, GlassAbsorbsByTheLengthInside) {
    // A cube of index 1, two units thick: nothing bends or reflects.
    auto scene =
        BeforeShiningWall(Make("dielectric", {{"ior", {1}}, {"absorption", {0.1f, 0.5f, 2}}}));
    AddMesh(scene.get(), Cube(1));
    // Russian roulette goes by what is left: noise of a fraction of 64 x 1024 paths, 4 times.
    EXPECT_NEAR(Seen(scene, 0, 1024), std::exp(-0.2), 4 * 0.4 / 256);
    EXPECT_NEAR(Seen(scene, 1, 1024), std::exp(-1.0), 4 * 0.2 / 256);
    EXPECT_NEAR(Seen(scene, 2, 1024), std::exp(-4.0), 4 * 0.01 / 256);
}

TEST(Materials, LampInsideGlassIsAbsorbedHoweverItIsFound) {
    // A white floor and a lamp over it inside a block of index 1, seen through its side; lamp found
    // by light sampling alone (a point) or by either (a quad).
    const auto seen = [](bool point, float sigma) {
        auto scene = std::make_shared<Scene>();
        scene->materials = {
            Make("dielectric", {{"ior", {1}}, {"absorption", {sigma, sigma, sigma}}}),
            Diffuse({1, 1, 1}), Diffuse({0, 0, 0}, {1, 1, 1})};
        AddMesh(scene.get(), Cube(0));
        AddMesh(scene.get(), Quad({-0.9f, -0.9f, 0.9f}, {0.9f, -0.9f, 0.9f}, {0.9f, -0.9f, -0.9f},
                                  {-0.9f, -0.9f, -0.9f}, 1));
        if (point) {
            scene->lights.push_back(PointLight({0, 0.1f, 0}, {1, 1, 1}));
        } else {
            AddMesh(scene.get(), Quad({-0.01f, 0.1f, -0.01f}, {0.01f, 0.1f, -0.01f},
                                      {0.01f, 0.1f, 0.01f}, {-0.01f, 0.1f, 0.01f}, 2));
        }
        // From outside, down at the middle of the floor: 2 / cos of the way lies inside... straight
        // down past the lamp's edge.
        scene->cameras.push_back(
            PerspectiveCamera({0.02f, 9, 0}, {0.02f, 0, 0}, 1e-4f, {0, 0, -1}));
        return Seen(scene, 1, 1024, 3);
    };
    // 1 from lamp to floor, 1.9 from there to the block's top.
    for (const bool point : {true, false}) {
        const double clear = seen(point, 0), dim = seen(point, 0.5f);
        EXPECT_GT(clear, 0) << point;
        EXPECT_NEAR(dim / clear, std::exp(-0.5 * 2.9), 0.01) << point;
    }
}

TEST(Materials, VolumeOfGltfAbsorbs) {
    Material glass = Make("metallic_roughness", {{"transmission", {1}},
                                                 {"metallic", {0}},
                                                 {"roughness", {0}},
                                                 {"ior", {1}},
                                                 {"absorption", {0.1f, 0.5f, 2}}});
    glass.params.Set("thin", false);
    auto scene = BeforeShiningWall(glass);
    AddMesh(scene.get(), Cube(1));
    EXPECT_NEAR(Seen(scene, 1, 1024), std::exp(-1.0), 4 * 0.2 / 256);
}

TEST(Materials, PaneReflectsBetweenItsSides) {
    auto scene = BeforeShiningWall(Make("thin_dielectric", {{"ior", {1.5f}}}));
    AddMesh(scene.get(), Quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, 1));
    // 0.04 once; all reflections: 2 r / (1 + r).
    EXPECT_NEAR(Seen(scene, 1, 4096), 1 - 0.08 / 1.04, 3e-3);
}

TEST(Materials, MixTakesItsShares) {
    auto scene = BeforeShiningWall(
        Make("mix", {{"material_a", {2}}, {"material_b", {3}}, {"amount", {0.25f}}}));
    scene->materials.push_back(Make("thin_dielectric", {{"ior", {1}}}));  // lets all through
    scene->materials.push_back(Diffuse({0, 0, 0}));
    AddMesh(scene.get(), Quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, 1));
    EXPECT_NEAR(Seen(scene, 1, 4096), 0.75, 4 * 0.44 / 512);
    // By texture: dark left texels, seen at the middle of the left half.
    const int texture = AddTexture(scene.get(), 1, 1, 1, std::vector<std::uint8_t>{102}, false);
    scene->materials[1].params.Set("amount", 1.0f);
    scene->materials[1].params.Set("amount_texture", static_cast<float>(texture));
    EXPECT_NEAR(Seen(scene, 1, 4096), 1 - 0.4, 4 * 0.49 / 512);
}

TEST(Materials, AlphaOfAnyType) {
    for (const char* type : {"conductor", "coated_diffuse", "dielectric", "mix"}) {
        Material material = Make(type, {{"alpha", {0}}});
        material.params.Set("alpha_mode", "mask");
        if (material.type == "mix") {
            material.params.Set("material_a", 0.0f);
            material.params.Set("material_b", 0.0f);
        }
        auto scene = BeforeShiningWall(material);
        AddMesh(scene.get(), Quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, 1));
        EXPECT_NEAR(Seen(scene, 1), 1, 1e-6) << type;
    }
}

// The shading normal of a unit quad in the xy plane, (u, v) = (x, y), under a bump map that rises
// along u by 0.5 over its width.
Vec3f BumpedNormal(const Transform& to_world, float scale, bool from_behind) {
    Scene scene;
    scene.materials = {Diffuse({1, 1, 1})};
    std::vector<float> ramp(64);
    for (std::size_t i = 0; i < ramp.size(); ++i) {
        ramp[i] = 0.5f * (static_cast<float>(i) + 0.5f) / 64;
    }
    const int texture = AddTexture(&scene, 64, 1, 1, ramp);
    scene.materials[0].params.Set("bump_texture", static_cast<float>(texture));
    scene.materials[0].params.Set("bump_scale", scale);
    AddMesh(&scene, Quad({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, 0), to_world);
    const Lit lit(scene);
    render::Ray ray;
    ray.direction = Vec3f{0, 0, from_behind ? 1.0f : -1.0f};
    ray.origin = to_world.Point({0.5f, 0.4f, 0}) - ray.direction;
    render::Hit hit;
    EXPECT_TRUE(lit.accel.Intersect(ray, &hit));
    const render::Object& object = lit.accel.objects()[0];
    return render::MakeSurface(object, hit, ray.origin, ray.direction, render::HitUv(object, hit),
                               lit.materials[0], lit.textures)
        .at.frame.z;
}

TEST(Materials, BumpTiltsTheNormalAgainstTheSlope) {
    const auto expect = [](Vec3f n, float slope) {
        const float length = std::sqrt(1 + slope * slope);
        EXPECT_NEAR(n.x, -slope / length, 1e-4);
        EXPECT_NEAR(n.y, 0, 1e-4);
        EXPECT_NEAR(n.z, 1 / length, 1e-4);
    };
    expect(BumpedNormal({}, 1, false), 0.5f);
    expect(BumpedNormal({}, 2, false), 1.0f);
    // Heights are in scene units: on a quad twice as wide the slope is half.
    expect(BumpedNormal(Transform::Scale({2, 2, 2}), 1, false), 0.25f);
    // The same surface from its back.
    expect(-BumpedNormal({}, 1, true), 0.5f);
}

}  // namespace
}  // namespace relume::test
