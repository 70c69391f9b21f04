#include <cmath>

#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

// A box of this size about `center`, as its eight corners.
Scene BoxScene(Vec3f center, Vec3f size) {
    Scene scene;
    Mesh mesh;
    for (int i = 0; i < 8; ++i) {
        mesh.positions.push_back(center + Vec3f{size.x * ((i & 1) != 0 ? 0.5f : -0.5f),
                                                size.y * ((i & 2) != 0 ? 0.5f : -0.5f),
                                                size.z * ((i & 4) != 0 ? 0.5f : -0.5f)});
    }
    mesh.triangles.push_back({0, 1, 2});
    scene.meshes.push_back(mesh);
    scene.instances.push_back({0, Transform()});
    return scene;
}

TEST(FitCamera, SeesTheWholeSceneAndFillsThePicture) {
    for (const float aspect : {0.25f, 1.0f, 1.78f, 4.0f}) {
        for (const Vec3f size : {Vec3f{1, 1, 1}, Vec3f{1e-3f, 0, 2e-3f}, Vec3f{50, 3, 9},
                                 Vec3f{0, 0, 1000}, Vec3f{1, 200, 1}}) {
            const Scene scene = BoxScene({5, -7, 11}, size);
            const Camera camera = FitCamera(scene.Bounds(), "scene", aspect);
            EXPECT_EQ(camera.type, "perspective");
            const float tan_y = std::tan(camera.params.GetFloat("yfov", 0) / 2);
            const Transform to_camera = camera.to_world.Inverse();
            float farthest = 0;  // from the middle of the picture; 1 is its border
            for (const Vec3f& p : scene.meshes[0].positions) {
                const Vec3f q = to_camera.Point(p);
                ASSERT_LT(q.z, 0);
                farthest = std::max(farthest, std::abs(q.y) / (-q.z * tan_y));
                farthest = std::max(farthest, std::abs(q.x) / (-q.z * tan_y * aspect));
            }
            EXPECT_LT(farthest, 1) << aspect << " " << size.x << " " << size.y << " " << size.z;
            EXPECT_GT(farthest, 0.9f) << aspect << " " << size.x << " " << size.y << " " << size.z;
        }
    }
}

TEST(FitCamera, LooksFromSlightlyAboveWithYUp) {
    const Camera camera = FitCamera(BoxScene({0, 0, 0}, {1, 1, 1}).Bounds(), "scene", 1);
    const Vec3f view = camera.to_world.Vector({0, 0, -1});
    EXPECT_LT(view.y, 0);
    EXPECT_GT(view.y, -0.5f);
    EXPECT_GT(camera.to_world.Vector({0, 1, 0}).y, 0.8f);
    EXPECT_NEAR(camera.to_world.Vector({1, 0, 0}).y, 0, 1e-6f);
    EXPECT_NEAR(camera.params.GetFloat("yfov", 0), 40 * kPi / 180, 1e-6f);
}

}  // namespace
}  // namespace relume::test
