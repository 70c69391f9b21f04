#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace relume::test {
namespace {

// A white floor under a point light straight above, seen from above; between them a sheet of
// `material` whose left half (u < 0.5, x < 0) is cut out or thin, by texture.
std::shared_ptr<Scene> UnderSheet(const char* mode, std::uint8_t left, std::uint8_t right,
                                  float look_at_x) {
    auto scene = std::make_shared<Scene>();
    scene->materials = {Diffuse({1, 1, 1}), Diffuse({0, 0, 0})};
    AddMesh(scene.get(), Quad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}, 0));
    AddMesh(scene.get(), Quad({-4, 2, 4}, {4, 2, 4}, {4, 2, -4}, {-4, 2, -4}, 1));
    const int texture = AddTexture(scene.get(), 2, 1, 4,
                                   std::vector<std::uint8_t>{0, 0, 0, left, 0, 0, 0, right}, false);
    scene->textures[0].nearest = true;
    scene->materials[1].params.Set("base_color_texture", static_cast<float>(texture));
    scene->materials[1].params.Set("alpha_mode", mode);
    scene->lights.push_back(PointLight({look_at_x, 8, 0}, {64, 64, 64}));
    // The camera lies below the sheet or above it as the test wants: y = 10 is above.
    scene->cameras.push_back(
        PerspectiveCamera({look_at_x, 10, 0}, {look_at_x, 0, 0}, 1e-3f, {0, 0, -1}));
    return scene;
}

double MeanOf(const std::shared_ptr<Scene>& scene, std::uint32_t spp = 16) {
    return EstimateMean(RenderAll(scene, Settings(8, 8, 2), spp), 0).mean;
}

constexpr double kLit = 1 / 3.14159265;  // 64 / 8^2 / pi

TEST(Alpha, MaskLetsViewAndLightThrough) {
    EXPECT_NEAR(MeanOf(UnderSheet("mask", 100, 200, -2)), kLit, 1e-4);  // cut-off is at 127.5
    EXPECT_EQ(MeanOf(UnderSheet("mask", 100, 200, 2)), 0);
    EXPECT_NEAR(MeanOf(UnderSheet("mask", 200, 100, 2)), kLit, 1e-4);
}

TEST(Alpha, MaskThrowsShadows) {
    // Seen from below the sheet.
    for (const float x : {-2.0f, 2.0f}) {
        auto scene = UnderSheet("mask", 0, 255, x);
        scene->cameras[0] = PerspectiveCamera({x, 1, 0}, {x, 0, 0}, 1e-3f, {0, 0, -1});
        EXPECT_NEAR(MeanOf(scene), x < 0 ? kLit : 0, 1e-4);
    }
}

TEST(Alpha, OpaqueIgnoresAlpha) { EXPECT_EQ(MeanOf(UnderSheet("opaque", 0, 0, -2)), 0); }

TEST(Alpha, BlendStopsRaysInProportion) {
    // The view and the light each pass with probability 1 - alpha, independently.
    const double pass = 1 - 102 / 255.0;
    // 64 pixels of 256 samples: standard error of a fraction near a third, 4 times.
    EXPECT_NEAR(MeanOf(UnderSheet("blend", 102, 255, -2), 256) / kLit, pass * pass, 4 * 0.48 / 128);
    EXPECT_EQ(MeanOf(UnderSheet("blend", 102, 255, 2)), 0);
    EXPECT_NEAR(MeanOf(UnderSheet("blend", 0, 255, -2)), kLit, 1e-4);
}

}  // namespace
}  // namespace relume::test
