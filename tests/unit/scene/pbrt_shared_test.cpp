#include <filesystem>

#include "tests/unit/scene/pbrt_file.h"

namespace relume::test {
namespace {

namespace fs = std::filesystem;

// Scenes that this project did not make; the counts are those of the table beside them.
struct Known {
    const char* name;
    const char* path;  // below ../shared/scenes
    std::uint64_t triangles;
    std::size_t disks, pictures;
    int width, height;
};

class PbrtSharedScenes : public testing::TestWithParam<Known> {};

TEST_P(PbrtSharedScenes, LoadAsTheTableSaysAndWithoutNotes) {
    const Known& known = GetParam();
    const fs::path file = fs::path(RELUME_SOURCE_DIR) / "../shared/scenes" / known.path;
    if (!fs::exists(file)) {
        GTEST_SKIP() << "needs " << file << ", which is not there";
    }
    const auto source = MakeFolderSource(file.parent_path().string());
    const std::string main = file.filename().string();
    const Scene scene = LoadScene(*source, main, {.decode_images = false});
    std::uint64_t triangles = 0;
    std::size_t disks = 0;
    for (const Mesh& mesh : scene.meshes) {
        (mesh.name == "disk" ? disks : triangles) +=
            mesh.name == "disk" ? 1 : mesh.triangles.size();
    }
    EXPECT_EQ(triangles, known.triangles);
    EXPECT_EQ(disks, known.disks);
    EXPECT_EQ(scene.images.size(), known.pictures);
    EXPECT_EQ(scene.hints.width, known.width);
    EXPECT_EQ(scene.hints.height, known.height);
    EXPECT_TRUE(scene.HasLight());
    EXPECT_EQ(scene.cameras.size(), 1u);
    EXPECT_EQ(Text(scene), "");
    const std::vector<std::string> files = ListSceneFiles(*source, main);
    EXPECT_EQ(files.front(), main);
    for (const std::string& name : files) {
        EXPECT_TRUE(fs::exists(file.parent_path() / name)) << name;
    }
}

INSTANTIATE_TEST_SUITE_P(
    All, PbrtSharedScenes,
    testing::Values(Known{"ajar", "veach-ajar/scene.pbrt", 382690, 0, 3, 1280, 720},
                    Known{"ajar4", "veach-ajar/scene-v4.pbrt", 382690, 0, 3, 1280, 720},
                    Known{"staircase", "staircase/scene.pbrt", 262663, 0, 10, 720, 1280},
                    Known{"staircase2", "staircase2/scene-v4.pbrt", 30927, 5, 3, 1024, 1024},
                    Known{"classroom", "classroom/scene.pbrt", 103832, 0, 4, 1280, 720},
                    Known{"coffee", "coffee/scene.pbrt", 235271, 0, 0, 800, 1000},
                    Known{"cornell", "cornell-box/scene.pbrt", 36, 0, 0, 1024, 1024}),
    [](const auto& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace relume::test
