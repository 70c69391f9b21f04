#include <filesystem>

#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

namespace fs = std::filesystem;

// Scenes that this project did not make; the counts are those of the table beside them.
struct Known {
    const char* folder;
    const char* file;
    std::uint64_t triangles, distinct;
    std::size_t pictures;  // that something visible uses
};

class SharedScenes : public testing::TestWithParam<Known> {};

TEST_P(SharedScenes, LoadWithTheTrianglesOfTheTable) {
    const Known& known = GetParam();
    const fs::path folder = fs::path(RELUME_SOURCE_DIR) / "../shared/scenes" / known.folder;
    if (!fs::exists(folder / known.file)) {
        GTEST_SKIP() << "needs " << (folder / known.file) << ", which is not there";
    }
    const auto source = MakeFolderSource(folder.string());
    const Scene scene = LoadScene(*source, known.file, {.decode_images = false});
    EXPECT_EQ(scene.TriangleCount(), known.triangles);
    std::uint64_t distinct = 0;
    for (const Mesh& mesh : scene.meshes) {
        distinct += mesh.triangles.size();
    }
    EXPECT_EQ(distinct, known.distinct);
    EXPECT_EQ(scene.images.size(), known.pictures);
    // What a scene lacks is its own: chess has two meshes with broken normals, the truck moves.
    for (const std::string& note : scene.notes) {
        EXPECT_THAT(note, testing::AnyOf(testing::HasSubstr("'Bishop_Shared', primitive 0: normals "
                                                            "of length 0"),
                                         testing::HasSubstr("animation")));
    }
    EXPECT_EQ(ListSceneFiles(*source, known.file).size(), known.pictures + 2);
}

INSTANTIATE_TEST_SUITE_P(All, SharedScenes,
                         testing::Values(Known{"sponza", "Sponza.gltf", 262267, 262267, 69},
                                         Known{"chess", "ABeautifulGame.gltf", 1430784, 565848, 33},
                                         Known{"toycar", "ToyCar.gltf", 108936, 108936, 7},
                                         Known{"milk-truck", "CesiumMilkTruck.gltf", 3624, 2856,
                                               1}),
                         [](const auto& param) {
                             const std::string name = param.param.folder;
                             return name.substr(0, name.find('-'));
                         });

}  // namespace
}  // namespace relume::test
