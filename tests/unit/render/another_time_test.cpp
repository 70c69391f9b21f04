#include <gtest/gtest.h>

#include "tests/support/scenes.h"
#include "worker/render/render.h"

namespace relume::render {
namespace {

// A box with a textured floor, in which a ball moves or stands still, and is seen from elsewhere.
Scene AtTime(float time, bool blurred, bool pixels) {
    Scene scene = *test::CornellBox();
    scene.name = "box";
    Material checked = test::Diffuse({1, 1, 1});
    const int texture = test::AddTexture(&scene, 2, 1, 3,
                                         std::vector<std::uint8_t>{250, 20, 20, 20, 20, 250}, true);
    checked.params.Set("base_color_texture", static_cast<float>(texture));
    scene.materials.push_back(checked);
    const int material = static_cast<int>(scene.materials.size()) - 1;
    test::AddMesh(&scene, test::Sphere(material, 12),
                  Transform::Translate({0.3f * time, 0.2f, 0}) * Transform::Scale({.3f, .3f, .3f}));
    if (blurred) {
        Instance& ball = scene.instances.back();
        ball.motion = {ball.to_world, Transform::Translate({0.1f, 0, 0}) * ball.to_world};
    }
    scene.cameras = {test::PerspectiveCamera({0.1f * time, 0, 3}, {0, 0, 0}, 0.8f)};
    if (!pixels) {
        for (SceneImage& image : scene.images) {
            image.bytes.clear();
            image.channels = 0;
        }
    }
    return scene;
}

TileResult Render(const std::shared_ptr<const BuiltScene>& built) {
    const RenderSettings settings = test::Settings(24, 24, 5);
    TileTask task;
    task.rect = {0, 0, 24, 24};
    task.first.assign(24 * 24, 0);
    task.count.assign(24 * 24, 4);
    return Renderer(built, settings).RenderTile(task, CancelToken());
}

std::shared_ptr<const BuiltScene> Build(float time, bool blurred, bool more = false) {
    return std::make_shared<const BuiltScene>(AtTime(time, blurred, true), more);
}

TEST(AnotherTime, HasTheBitsOfASceneBuiltAnew) {
    const auto first = Build(0, false, true);
    for (const bool blurred : {false, true}) {
        const auto fresh = Render(Build(1, blurred));
        const auto second = first->AtAnotherTime(AtTime(1, blurred, false));
        ASSERT_NE(second, nullptr);
        EXPECT_EQ(Render(second).planes, fresh.planes);
        // And of that one another.
        const auto third = second->AtAnotherTime(AtTime(0, false, false));
        ASSERT_NE(third, nullptr);
        EXPECT_EQ(Render(third).planes, Render(first).planes);
        EXPECT_NE(Render(third).planes, fresh.planes);
    }
}

TEST(AnotherTime, OutlivesTheOneThatItWasMadeOf) {
    auto first = Build(0, true, true);
    const auto second = first->AtAnotherTime(AtTime(1, true, false));
    first.reset();
    EXPECT_EQ(Render(second).planes, Render(Build(1, true)).planes);
}

TEST(AnotherTime, OfAnotherLookThereIsNone) {
    const auto first = Build(0, false, true);
    Scene painted = AtTime(1, false, false);
    painted.materials[0].params.Set("base_color", std::vector<float>{0.1f, 0.2f, 0.3f});
    EXPECT_EQ(first->AtAnotherTime(painted), nullptr);

    Scene textured = AtTime(1, false, false);
    textured.textures[0].wrap_u = WrapMode::kClamp;
    EXPECT_EQ(first->AtAnotherTime(textured), nullptr);

    Scene lit = AtTime(1, false, false);
    test::SetEnvironment(&lit, {1, 1, 1});
    EXPECT_EQ(first->AtAnotherTime(lit), nullptr);

    // Its picture's pixels would be needed.
    Scene mapped = AtTime(1, false, false);
    Light light = test::PointLight({0, 0, 0}, {1, 1, 1});
    light.type = "goniometric";
    light.params.Set("image", 0.0f);
    mapped.lights.push_back(light);
    EXPECT_EQ(first->AtAnotherTime(mapped), nullptr);
}

}  // namespace
}  // namespace relume::render
