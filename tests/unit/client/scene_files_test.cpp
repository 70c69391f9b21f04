#include "client/lib/scene_files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "client/cli/scene_needs.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/sha256.h"
#include "core/image/png_view.h"

namespace relume::client {
namespace {

namespace fs = std::filesystem;

// One textured triangle in its own buffer file. `material` goes into the material's JSON, `extra`
// into the file's.
std::string Gltf(const std::string& material = "", const std::string& extra = "") {
    return R"({"asset":{"version":"2.0"},
        "buffers":[{"uri":"mesh.bin","byteLength":60}],
        "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":24}],
        "accessors":[
            {"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
            {"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}],
        "images":[{"uri":"textures/a%20b.png"}],
        "textures":[{"source":0}],
        "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}})" +
           material + R"(}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}],
        "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0)" +
           extra + "}";
}

const char* const kGlowing = R"(,"emissiveFactor":[1,1,1])";
const char* const kCameras = R"(,"cameras":[
    {"name":"front","type":"perspective","perspective":{"znear":0.1,"yfov":1,"aspectRatio":2}},
    {"name":"side","type":"perspective","perspective":{"znear":0.1,"yfov":1}}])";

class SceneFilesTest : public testing::Test {
  protected:
    SceneFilesTest() {
        const float vertices[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1};
        fs::create_directories(scene_ / "textures");
        Write(scene_ / "scene.gltf", Gltf(kGlowing));
        Write(scene_ / "mesh.bin", {reinterpret_cast<const char*>(vertices), sizeof vertices});
        WritePngView(scene_ / "textures/a b.png", Image(5, 3, {"R", "G", "B"}));
        // A Radiance picture of 4x2 grey pixels, not packed.
        Write(sky_, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" + std::string(32, '\x80'));
    }
    static void Write(const fs::path& path, const std::string& bytes) {
        fs::create_directories(path.parent_path());
        WriteFileAtomically(path, bytes);
    }
    std::string main() const { return scene_ / "scene.gltf"; }

    TemporaryFolder folder_;
    fs::path scene_ = folder_.path() / "scene";
    fs::path sky_ = folder_.path() / "elsewhere" / "sky.hdr";
};

// The message of the Error that `body` throws; "" if none.
template <typename Body>
std::string Message(Body body) {
    try {
        body();
        return "";
    } catch (const Error& error) {
        return error.what();
    }
}

TEST_F(SceneFilesTest, ManifestListsEveryFileOnceWithItsDigest) {
    const LocalScene scene = CollectScene(main(), "");
    EXPECT_EQ(scene.manifest.main, "scene.gltf");
    ASSERT_EQ(scene.manifest.entries.size(), 3u);
    EXPECT_EQ(scene.manifest.entries[0].path, "scene.gltf");
    EXPECT_EQ(scene.manifest.entries[1].path, "mesh.bin");
    EXPECT_EQ(scene.manifest.entries[2].path, "textures/a b.png");
    for (const auto& entry : scene.manifest.entries) {
        const std::string bytes = ReadFile(scene_ / entry.path);
        EXPECT_EQ(entry.size, bytes.size());
        EXPECT_EQ(entry.sha256, Sha256Hex(bytes));
        EXPECT_EQ(ReadFile(scene.files.at(entry.path)), bytes);
        EXPECT_EQ(MakeLocalSource(scene)->Read(entry.path), bytes);
    }
    EXPECT_EQ(scene.environment, "");
}

TEST_F(SceneFilesTest, EnvironmentElsewhereIsEnteredBesideTheScene) {
    const LocalScene scene = CollectScene(main(), sky_);
    EXPECT_EQ(scene.environment, "environment/sky.hdr");
    EXPECT_EQ(scene.manifest.entries.back().path, scene.environment);
    EXPECT_EQ(scene.manifest.entries.back().sha256, Sha256Hex(ReadFile(sky_)));
    const Scene loaded = LoadForChecks(scene, {.environment_scale = 2});
    ASSERT_NE(loaded.environment, nullptr);
    EXPECT_EQ(loaded.images[static_cast<std::size_t>(loaded.environment->image)].width, 4);
}

TEST_F(SceneFilesTest, EnvironmentInTheFolderKeepsItsName) {
    Write(scene_ / "maps/sky.hdr", ReadFile(sky_));
    EXPECT_EQ(CollectScene(main(), scene_ / "maps/sky.hdr").environment, "maps/sky.hdr");
    EXPECT_EQ(CollectScene(main(), scene_ / "textures/../maps/sky.hdr").environment,
              "maps/sky.hdr");
}

TEST_F(SceneFilesTest, SceneInTheCurrentFolderNeedsNoPath) {
    const fs::path before = fs::current_path();
    fs::current_path(scene_);
    const LocalScene scene = CollectScene("scene.gltf", "");
    fs::current_path(before);
    EXPECT_EQ(ManifestDigest(scene.manifest), ManifestDigest(CollectScene(main(), "").manifest));
}

TEST_F(SceneFilesTest, NamesWhatIsMissing) {
    EXPECT_NE(Message([&] { CollectScene(scene_ / "no.gltf", ""); }).find("no.gltf"),
              std::string::npos);
    EXPECT_NE(Message([&] { CollectScene(scene_, ""); }).find("is not a file"), std::string::npos);
    EXPECT_NE(Message([&] { CollectScene(main(), "no.hdr"); }).find("no.hdr"), std::string::npos);
    fs::remove(scene_ / "textures/a b.png");
    EXPECT_NE(Message([&] { CollectScene(main(), ""); }).find("a b.png"), std::string::npos);
}

TEST_F(SceneFilesTest, ChecksRefuseDarknessUnlessAskedFor) {
    Write(main(), Gltf());
    const Scene scene = LoadForChecks(CollectScene(main(), ""), {});
    RenderSettings settings;
    const std::string message = Message([&] { CheckScene(scene, settings); });
    EXPECT_NE(message.find("--environment"), std::string::npos) << message;
    EXPECT_NE(message.find("--allow-black"), std::string::npos) << message;
    settings.allow_black = true;
    EXPECT_EQ(Message([&] { CheckScene(scene, settings); }), "");
    settings.allow_black = false;
    const Scene lit = LoadForChecks(CollectScene(main(), sky_), {});
    EXPECT_EQ(Message([&] { CheckScene(lit, settings); }), "");
}

TEST_F(SceneFilesTest, SaysThatACameraIsFitted) {
    const Scene scene = LoadForChecks(CollectScene(main(), ""), {});
    const auto notes = CheckScene(scene, {});
    ASSERT_FALSE(notes.empty());
    EXPECT_NE(notes.back().find("no camera"), std::string::npos);
    RenderSettings settings;
    settings.camera = "front";
    EXPECT_NE(Message([&] { CheckScene(scene, settings); }).find("there is none"),
              std::string::npos);
}

TEST_F(SceneFilesTest, FindsCamerasByNameAndIndex) {
    Write(main(),
          Gltf(kGlowing, std::string(kCameras) + R"(,"nodes":[{"mesh":0},{"camera":0},{"camera":1}],
            "scenes":[{"nodes":[0,1,2]}])"));
    // The keys come twice in this JSON: the later ones count.
    const Scene scene = LoadForChecks(CollectScene(main(), ""), {});
    ASSERT_EQ(scene.cameras.size(), 2u);
    EXPECT_EQ(FindCamera(scene, ""), &scene.cameras[0]);
    EXPECT_EQ(FindCamera(scene, "1"), &scene.cameras[1]);
    EXPECT_EQ(FindCamera(scene, scene.cameras[1].name), &scene.cameras[1]);
    for (const char* unknown : {"2", "-1", "rear"}) {
        const std::string message = Message([&] { FindCamera(scene, unknown); });
        EXPECT_NE(message.find(scene.cameras[0].name), std::string::npos) << message;
    }
}

TEST(SetDefaultSize, FollowsTheCamerasShape) {
    RenderSettings settings;
    SetDefaultSize(nullptr, &settings);
    EXPECT_EQ(settings.width, 1280);
    EXPECT_EQ(settings.height, 720);
    Camera camera;
    camera.params.Set("aspect_ratio", 2.0f);
    SetDefaultSize(&camera, &settings);
    EXPECT_EQ(settings.width, 1440);
}

TEST_F(SceneFilesTest, NeedsAreWhatIsUsed) {
    const auto needs = SceneNeeds(LoadForChecks(CollectScene(main(), sky_), {}));
    EXPECT_EQ(needs, (std::vector<std::string>{"textures (1 material)", "area lights (1 material)",
                                               "environment map"}));
}

}  // namespace
}  // namespace relume::client
