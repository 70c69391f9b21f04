#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/scenes.h"

namespace relume::test {
namespace {

// Mean of a feature over the film.
double Mean(const Film& film, int feature) {
    double sum = 0;
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        sum +=
            (film.Plane(kFeatureMeanA + feature)[i] + film.Plane(kFeatureMeanB + feature)[i]) / 2;
    }
    return sum / static_cast<double>(film.pixel_count());
}

// A wall in the plane z = 0, seen along -z from z = 4 through a narrow camera.
std::shared_ptr<Scene> Wall(Material material) {
    auto scene = std::make_shared<Scene>();
    scene->materials = {std::move(material)};
    AddMesh(scene.get(), Quad({-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}, 0));
    scene->lights.push_back(PointLight({0, 3, 4}, {5, 5, 5}));
    scene->cameras.push_back(PerspectiveCamera({0, 0, 4}, {0, 0, 0}, 1e-3f));
    return scene;
}

Film Render(const std::shared_ptr<Scene>& scene, int depth = 5) {
    return RenderAll(scene, Settings(8, 8, depth), 8);
}

TEST(Features, OfTheFirstHit) {
    const Film film = Render(Wall(Diffuse({0.2f, 0.4f, 0.6f})));
    EXPECT_NEAR(Mean(film, kAlbedoR), 0.2, 1e-6);
    EXPECT_NEAR(Mean(film, kAlbedoG), 0.4, 1e-6);
    EXPECT_NEAR(Mean(film, kAlbedoB), 0.6, 1e-6);
    EXPECT_NEAR(Mean(film, kNormalZ), 1, 1e-6);
    EXPECT_NEAR(Mean(film, kDepth), 4, 1e-4);
    EXPECT_EQ(Mean(film, kVisibility), 1);
}

TEST(Features, NormalFacesTheCamera) {
    auto scene = Wall(Diffuse({0.5f, 0.5f, 0.5f}));
    std::swap(scene->meshes[0].positions[1], scene->meshes[0].positions[3]);  // seen from the back
    EXPECT_NEAR(Mean(Render(scene), kNormalZ), 1, 1e-6);
}

TEST(Features, VisibilityIsOfTheFirstHitAlone) {
    // A plate hides the light from what the camera sees, while the walls around it are lit and
    // light it: later vertices of the path must not count.
    auto scene = Wall(Diffuse({0.9f, 0.9f, 0.9f}));
    AddMesh(scene.get(), Quad({-1, 0.5f, 1}, {1, 0.5f, 1}, {1, 0.5f, 0.1f}, {-1, 0.5f, 0.1f}, 0));
    AddMesh(scene.get(), Quad({-9, -1, 9}, {9, -1, 9}, {9, -1, 0}, {-9, -1, 0}, 0));
    const Film film = Render(scene);
    EXPECT_EQ(Mean(film, kVisibility), 0);
    EXPECT_GT(EstimateMean(film, 0).mean, 0.001);  // lit indirectly
}

TEST(Features, LookBehindMirrors) {
    // A mirror at 45 degrees sends the view along +x, to a wall at x = 3.
    auto scene = Wall(MetallicRoughness({0.5f, 0.8f, 1}, 1, 0));
    scene->materials.push_back(Diffuse({0.4f, 0.4f, 0.4f}));
    scene->meshes.clear();
    scene->instances.clear();
    AddMesh(scene.get(), Quad({-1, -1, -1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, -1}, 0));
    AddMesh(scene.get(), Quad({-3, -9, -9}, {-3, -9, 9}, {-3, 9, 9}, {-3, 9, -9}, 1));
    AddMesh(scene.get(), Quad({3, -9, 9}, {3, -9, -9}, {3, 9, -9}, {3, 9, 9}, 1));
    const Film film = Render(scene);
    EXPECT_NEAR(Mean(film, kAlbedoR), 0.5 * 0.4, 1e-3);  // times the mirror's colour
    EXPECT_NEAR(Mean(film, kAlbedoG), 0.8 * 0.4, 1e-2);  // Schlick at 45 degrees adds a little
    EXPECT_NEAR(std::abs(Mean(film, kNormalX)), 1, 1e-5);
    EXPECT_NEAR(Mean(film, kDepth), 4 + 3, 1e-3);
}

TEST(Features, LookThroughGlass) {
    auto scene = Wall(Diffuse({0.5f, 0.5f, 0.5f}));
    scene->materials.push_back(Dielectric(1.0005f, 0));  // hardly reflects
    AddMesh(scene.get(), Cube(1), Transform::Translate({0, 0, 2}) * Transform::Scale({1, 1, 0.5f}));
    const Film film = Render(scene, 8);
    EXPECT_NEAR(Mean(film, kAlbedoG), 0.5, 1e-4);  // not scaled by the index
    EXPECT_NEAR(Mean(film, kDepth), 4, 1e-3);
    EXPECT_NEAR(Mean(film, kNormalZ), 1, 1e-4);
}

TEST(Features, MissHasTheEnvironmentsColour) {
    auto scene = Wall(Diffuse({0.5f, 0.5f, 0.5f}));
    SetEnvironment(scene.get(), {0.25f, 0.5f, 3});
    scene->cameras[0] = PerspectiveCamera({0, 0, 4}, {0, 0, 8}, 1e-3f);
    const Film film = Render(scene);
    EXPECT_NEAR(Mean(film, kAlbedoR), 0.25, 1e-6);
    EXPECT_NEAR(Mean(film, kAlbedoB), 1, 1e-6);
    EXPECT_EQ(Mean(film, kNormalX), 0);
    EXPECT_EQ(Mean(film, kNormalZ), 0);
    EXPECT_EQ(Mean(film, kVisibility), 0);
    EXPECT_NEAR(Mean(film, kDepth), 4 + std::sqrt(162.0), 1e-3);  // far side of the bounding sphere
}

}  // namespace
}  // namespace relume::test
