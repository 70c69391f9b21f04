#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/base/error.h"
#include "tests/support/scenes.h"
#include "worker/render/bsdf/registry.h"
#include "worker/render/bsdf/texture_packs.h"
#include "worker/render/texture/texture_set.h"

namespace relume::render {
namespace {

// A row of four greys, 0 85 170 255: values 0, 1/3, 2/3, 1.
Scene Greys() {
    Scene scene;
    test::AddTexture(&scene, 4, 1, 1, std::vector<std::uint8_t>{0, 85, 170, 255}, false);
    return scene;
}

float At(Scene scene, float u, float v = 0.5f) {
    return TextureSet(&scene, std::vector<bool>(scene.textures.size(), true), {})
        .Lookup(0, {u, v})
        .r;
}

TEST(Texture, BilinearBetweenTexelCentres) {
    const Scene scene = Greys();
    EXPECT_NEAR(At(scene, 0.125f), 0, 1e-6f);
    EXPECT_NEAR(At(scene, 0.375f), 1.0f / 3, 1e-6f);
    EXPECT_NEAR(At(scene, 0.25f), 1.0f / 6, 1e-6f);
    EXPECT_NEAR(At(scene, 0.8125f), 0.25f * 2 / 3 + 0.75f, 1e-6f);
}

TEST(Texture, NearestTakesTheTexel) {
    Scene scene = Greys();
    scene.textures[0].nearest = true;
    EXPECT_NEAR(At(scene, 0.249f), 0, 1e-6f);
    EXPECT_NEAR(At(scene, 0.251f), 1.0f / 3, 1e-6f);
    EXPECT_NEAR(At(scene, 0.9999f), 1, 1e-6f);
}

TEST(Texture, WrapModes) {
    Scene scene = Greys();
    scene.textures[0].wrap_u = WrapMode::kRepeat;
    EXPECT_NEAR(At(scene, 1.375f), 1.0f / 3, 1e-6f);
    EXPECT_NEAR(At(scene, -0.625f), 1.0f / 3, 1e-6f);
    EXPECT_NEAR(At(scene, 0), 0.5f, 1e-6f);  // half last, half first
    scene.textures[0].wrap_u = WrapMode::kClamp;
    EXPECT_NEAR(At(scene, 1.375f), 1, 1e-6f);
    EXPECT_NEAR(At(scene, -0.625f), 0, 1e-6f);
    EXPECT_NEAR(At(scene, 0), 0, 1e-6f);
    scene.textures[0].wrap_u = WrapMode::kMirror;
    EXPECT_NEAR(At(scene, 1.375f), 2.0f / 3, 1e-6f);   // at 0.625
    EXPECT_NEAR(At(scene, -0.375f), 1.0f / 3, 1e-6f);  // at 0.375
    EXPECT_NEAR(At(scene, 2.375f), 1.0f / 3, 1e-6f);
}

TEST(Texture, RowZeroIsTheTop) {
    Scene scene;
    test::AddTexture(&scene, 1, 2, 1, std::vector<std::uint8_t>{255, 0}, false);
    scene.textures[0].nearest = true;
    EXPECT_EQ(At(scene, 0.5f, 0.25f), 1);
    EXPECT_EQ(At(scene, 0.5f, 0.75f), 0);
}

TEST(Texture, SrgbIsDecodedButNotAlpha) {
    Scene scene;
    test::AddTexture(&scene, 1, 1, 4, std::vector<std::uint8_t>{188, 10, 255, 128}, true);
    const Rgba t = TextureSet(&scene, {true}, {}).Lookup(0, {0.5f, 0.5f});
    EXPECT_NEAR(t.r, std::pow((188 / 255.0 + 0.055) / 1.055, 2.4), 1e-6);
    EXPECT_NEAR(t.g, 10 / 255.0 / 12.92, 1e-6);
    EXPECT_EQ(t.b, 1);
    EXPECT_NEAR(t.a, 128 / 255.0, 1e-6);
}

TEST(Texture, ChannelsAreFilledUp) {
    Scene scene;
    test::AddTexture(&scene, 1, 1, 1, std::vector<std::uint8_t>{51}, false);
    test::AddTexture(&scene, 1, 1, 2, std::vector<std::uint8_t>{51, 102}, false);
    test::AddTexture(&scene, 1, 1, 3, std::vector<float>{1, 2, 3});
    const TextureSet set(&scene, {true, true, true}, {});
    const Rgba grey = set.Lookup(0, {}), grey_alpha = set.Lookup(1, {}), color = set.Lookup(2, {});
    EXPECT_NEAR(grey.b, 0.2f, 1e-6f);
    EXPECT_EQ(grey.a, 1);
    EXPECT_NEAR(grey_alpha.g, 0.2f, 1e-6f);
    EXPECT_NEAR(grey_alpha.a, 0.4f, 1e-6f);
    EXPECT_EQ(color.b, 3);
    EXPECT_EQ(color.a, 1);
}

TEST(Texture, LargePictureIsReadAsWritten) {
    // Every texel of an odd-sized picture lands where its row and column say.
    const int w = 13, h = 9;
    Scene scene;
    std::vector<std::uint8_t> bytes;
    for (int i = 0; i < w * h; ++i) {
        bytes.push_back(static_cast<std::uint8_t>(i));
    }
    test::AddTexture(&scene, w, h, 1, bytes, false);
    scene.textures[0].nearest = true;
    const TextureSet set(&scene, {true}, {});
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            const Vec2f uv{(static_cast<float>(x) + 0.5f) / w, (static_cast<float>(y) + 0.5f) / h};
            EXPECT_NEAR(set.Lookup(0, uv).r * 255, y * w + x, 1e-3f);
        }
    }
}

TEST(Texture, TransformOfCoordinates) {
    Scene scene = Greys();
    const float m[6] = {2, 0, 0.125f, 0, 1, 0};
    std::copy(m, m + 6, scene.textures[0].uv_transform);
    EXPECT_NEAR(At(scene, 0.125f), 1.0f / 3, 1e-6f);
}

TEST(Texture, CoordinatesOutOfAllRangeReadSomeTexel) {
    for (const WrapMode wrap : {WrapMode::kRepeat, WrapMode::kClamp, WrapMode::kMirror}) {
        Scene scene = Greys();
        scene.textures[0].wrap_u = scene.textures[0].wrap_v = wrap;
        const float inf = std::numeric_limits<float>::infinity();
        for (const float u : {inf, -inf, std::nanf(""), 1e38f, -1e30f, -1e-30f, 3e9f}) {
            for (const bool nearest : {false, true}) {
                scene.textures[0].nearest = nearest;
                const float value = At(scene, u, u);
                EXPECT_TRUE(value >= 0 && value <= 1) << u;
            }
        }
    }
}

TEST(Texture, PictureWithoutPixelsIsRefused) {
    Scene scene = Greys();
    scene.images[0].bytes.clear();
    EXPECT_THROW(TextureSet(&scene, {true}, {}), Error);
    EXPECT_NO_THROW(TextureSet(&scene, {false}, {}));
}

// A material of three different textures of 7 x 5 random texels.
Scene ThreePictures() {
    Scene scene;
    std::mt19937 random(3);
    for (const int channels : {3, 3, 4}) {
        std::vector<std::uint8_t> bytes(static_cast<std::size_t>(7 * 5 * channels));
        for (std::uint8_t& b : bytes) {
            b = static_cast<std::uint8_t>(random());
        }
        test::AddTexture(&scene, 7, 5, channels, bytes, channels == 3 && scene.images.empty());
    }
    Material material = test::MetallicRoughness({1, 1, 1}, 1, 1);
    material.params.Set("base_color_texture", 0.0f);
    material.params.Set("normal_texture", 1.0f);
    material.params.Set("metallic_roughness_texture", 2.0f);
    scene.materials = {material};
    return scene;
}

std::vector<TexturePack> Plan(const Scene& scene) {
    std::vector<CompiledMaterial> materials = CompileMaterials(scene);
    return PlanTexturePacks(scene, std::vector<bool>(materials.size(), true), &materials);
}

TEST(TexturePack, ReadsWhatTheTexturesHold) {
    for (const bool nearest : {false, true}) {
        Scene scene = ThreePictures();
        for (Texture& texture : scene.textures) {
            texture.nearest = nearest;
            texture.wrap_v = WrapMode::kMirror;
        }
        const std::vector<TexturePack> packs = Plan(scene);
        ASSERT_EQ(packs.size(), 1u);
        Scene copy = scene;
        const TextureSet plain(&copy, {true, true, true}, {}),
            packed(&scene, {true, true, true}, packs);
        EXPECT_LT(packed.bytes(), plain.bytes());
        for (float u = -1.3f; u < 2; u += 0.0137f) {
            const Vec2f uv{u, 0.7f - 1.3f * u};
            const SurfaceTexels t = packed.LookupPack(0, uv);
            const Rgba base = plain.Lookup(0, uv), normal = plain.Lookup(1, uv),
                       surface = plain.Lookup(2, uv);
            EXPECT_EQ(t.base, (Rgb{base.r, base.g, base.b}));
            EXPECT_EQ(t.normal, (Vec3f{normal.r, normal.g, normal.b}));
            EXPECT_EQ(t.roughness, surface.g);
            EXPECT_EQ(t.metallic, surface.b);
        }
    }
}

TEST(TexturePack, TakesTheirBytesOutOfTheScene) {
    Scene scene = ThreePictures();
    const TextureSet set(&scene, {true, true, true}, Plan(scene));
    for (const SceneImage& image : scene.images) {
        EXPECT_TRUE(image.bytes.empty());
    }
}

TEST(TexturePack, WhatElseReadsIsNotPacked) {
    Scene other_size = ThreePictures();
    other_size.images[1].width = 5;
    other_size.images[1].height = 7;
    EXPECT_TRUE(Plan(other_size).empty());
    Scene other_place = ThreePictures();
    other_place.textures[2].uv_transform[0] = 2;
    EXPECT_TRUE(Plan(other_place).empty());
    Scene shared = ThreePictures();  // another material reads the base colour alone
    shared.materials.push_back(test::Diffuse({1, 1, 1}));
    shared.materials.back().params.Set("base_color_texture", 0.0f);
    EXPECT_TRUE(Plan(shared).empty());
    Scene alpha = ThreePictures();
    alpha.materials[0].params.Set("alpha_mode", "mask");
    EXPECT_TRUE(Plan(alpha).empty());
    Scene twice = ThreePictures();  // the same three: one pack
    twice.materials.push_back(twice.materials[0]);
    EXPECT_EQ(Plan(twice).size(), 1u);
}

}  // namespace
}  // namespace relume::render
