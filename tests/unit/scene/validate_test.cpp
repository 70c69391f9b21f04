#include <limits>

#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using testing::HasSubstr;

Scene Good() {
    Scene scene = Load(TriangleFile());
    scene.meshes[0].source = "x: mesh 0";
    scene.materials[0].source = "x: material 0";
    return scene;
}

// The message for a good scene that `change` has spoilt.
template <class F>
std::string Message(F&& change) {
    Scene scene = Good();
    change(&scene);
    return MessageOf([&] { ValidateScene(scene); });
}

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

TEST(ValidateScene, GoodScenesPass) { EXPECT_NO_THROW(ValidateScene(Good())); }

TEST(ValidateScene, MeshFaultsNameTheMesh) {
    EXPECT_THAT(Message([](Scene* s) { s->meshes[0].positions[1].y = kNaN; }),
                HasSubstr("x: mesh 0: vertex 1"));
    EXPECT_THAT(Message([](Scene* s) { s->meshes[0].triangles.clear(); }),
                HasSubstr("x: mesh 0: the mesh is empty"));
    EXPECT_THAT(Message([](Scene* s) { s->meshes[0].triangles[0].z = 3; }),
                HasSubstr("x: mesh 0: triangle 0 refers to vertex 3"));
    EXPECT_THAT(Message([](Scene* s) {
                    s->meshes[0].uvs = {{0, 0}};
                }),
                HasSubstr("x: mesh 0: 1 texture coordinates for 3"));
    EXPECT_THAT(Message([](Scene* s) {
                    s->meshes[0].uvs = {{0, 0}, {kNaN, 0}, {0, 0}};
                }),
                HasSubstr("x: mesh 0: the texture coordinate of vertex 1"));
    EXPECT_THAT(Message([](Scene* s) {
                    s->meshes[0].tangents.assign(3, {1, 0, 0});
                    s->meshes[0].tangent_signs.assign(2, 1);
                }),
                HasSubstr("x: mesh 0: tangents and their signs"));
    EXPECT_THAT(Message([](Scene* s) { s->meshes[0].material = 1; }),
                HasSubstr("x: mesh 0: material 1"));
}

TEST(ValidateScene, MotionFaultsNameTheThing) {
    const auto moving = [](std::vector<Vec3f> last) {
        return [last](Scene* s) { s->meshes[0].motion = {s->meshes[0].positions, last}; };
    };
    EXPECT_THAT(Message(moving({{0, 0, 0}})),
                HasSubstr("x: mesh 0: its motion has 2 keys, one of 1 positions for 3 vertices"));
    EXPECT_THAT(Message(moving({{0, 0, 0}, {0, kNaN, 0}, {0, 0, 0}})),
                HasSubstr("x: mesh 0: a moving vertex is not finite"));
    EXPECT_THAT(Message([](Scene* s) { s->meshes[0].motion = {s->meshes[0].positions}; }),
                HasSubstr("x: mesh 0: its motion has 1 keys"));
    EXPECT_THAT(Message([](Scene* s) { s->instances[0].motion.resize(1); }),
                HasSubstr("x: mesh 0: its motion has one key"));
    EXPECT_THAT(Message([](Scene* s) {
                    s->instances[0].motion = {Transform(), Transform::Scale({0, 1, 1})};
                }),
                HasSubstr("x: mesh 0: its transform is singular"));
    EXPECT_THAT(Message([](Scene* s) {
                    s->cameras.emplace_back();
                    s->cameras[0].source = "x: camera 0";
                    s->cameras[0].motion = {Transform(), Transform::Translate({kNaN, 0, 0})};
                }),
                HasSubstr("x: camera 0: its transform is not finite"));
}

TEST(ValidateScene, TheFirstOfSeveralFaultsIsTold) {
    EXPECT_THAT(Message([](Scene* s) {
                    for (int i = 1; i < 50; ++i) {
                        s->meshes.push_back(s->meshes[0]);
                        s->meshes.back().source = "x: mesh " + std::to_string(i);
                        s->meshes.back().triangles.clear();
                    }
                }),
                HasSubstr("x: mesh 1:"));
}

TEST(ValidateScene, MaterialFaultsNameTheMaterial) {
    EXPECT_THAT(Message([](Scene* s) { s->materials[0].params.Set("roughness", kNaN); }),
                HasSubstr("x: material 0: roughness"));
    EXPECT_THAT(Message([](Scene* s) { s->materials[0].params.Set("normal_texture", 0.0f); }),
                HasSubstr("x: material 0: normal_texture 0 does not exist"));
    EXPECT_THAT(Message([](Scene* s) { s->textures.push_back({.image = 2}); }),
                HasSubstr("image 2"));
}

TEST(ValidateScene, InstancesAndPictures) {
    EXPECT_THAT(Message([](Scene* s) { s->instances[0].mesh = 5; }), HasSubstr("mesh 5"));
    EXPECT_THAT(Message([](Scene* s) {
                    s->instances[0].to_world = Transform::Scale({1, 0, 1});
                }),
                HasSubstr("singular"));
    EXPECT_THAT(Message([](Scene* s) {
                    s->images.push_back({.name = "a.png", .width = 2, .height = 2, .channels = 3});
                    s->images[0].bytes.resize(11);
                }),
                HasSubstr("a.png"));
    EXPECT_THAT(Message([](Scene* s) {
                    s->environment = std::make_shared<Environment>(Environment{.image = 0});
                }),
                HasSubstr("environment image 0"));
    EXPECT_THAT(Message([](Scene* s) { s->instances.clear(); }), HasSubstr("no triangles"));
}

}  // namespace
}  // namespace relume::test
