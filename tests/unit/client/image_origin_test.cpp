#include "client/lib/image_origin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/base/error.h"
#include "core/base/files.h"

namespace relume::client {
namespace {

Image Rendered() {
    Image image(40, 20, {"R", "G", "B"});
    image.SetWindow(10, 5, 100, 50);
    image.metadata() = {
        {"relume.settings",
         R"({"width":100,"height":50,"crop":{"x0":10,"y0":5,"x1":50,"y1":25},"seed":7,)"
         R"("max_depth":5,"environment":"maps/sky.hdr","environment_scale":0.1})"},
        {"relume.scene_sha256", "abc"},
        {"relume.filter", "none"},
        {"relume.version", "relume 0.1.0"}};
    return image;
}

void ExpectRefused(const Image& image, const std::string& what) {
    try {
        ReadOrigin(image);
        ADD_FAILURE() << "nothing was thrown: " << what;
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr(what));
    }
}

TEST(ImageOrigin, IsWhatTheMetadataSay) {
    const ImageOrigin origin = ReadOrigin(Rendered());
    EXPECT_EQ(origin.settings.seed, 7u);
    EXPECT_EQ(origin.settings.max_depth, 5);
    EXPECT_EQ(origin.settings.environment_scale, 0.1f);
    EXPECT_EQ(origin.settings.lens_radius, -1);
    EXPECT_EQ(origin.scene_sha256, "abc");
    EXPECT_EQ(origin.filter, "none");
}

TEST(ImageOrigin, RefusesImagesOfOthersAndChangedOnes) {
    const Image rendered = Rendered();
    for (const auto& [key, value] : rendered.metadata()) {
        Image without = rendered;
        without.metadata().erase(key);
        ExpectRefused(without, key);
    }
    Image image = rendered;
    image.SetWindow(11, 5, 100, 50);
    ExpectRefused(image, "cut or scaled");
    image = Rendered();
    image.metadata()["relume.settings"] = R"({"width":100,"hieght":50})";
    ExpectRefused(image, "relume.settings");
    image.metadata()["relume.settings"] = R"({"width":100,"height":0})";
    EXPECT_THROW(ReadOrigin(image), Error);
}

TEST(ImageOrigin, FindsTheEnvironmentInTheScenesFolderOrAsksForIt) {
    const TemporaryFolder folder;
    const std::string scene = (folder.path() / "scene.gltf").string();
    ImageOrigin origin = ReadOrigin(Rendered());
    EXPECT_EQ(FindEnvironment(origin, scene, "elsewhere/sky.hdr"), "elsewhere/sky.hdr");
    try {
        FindEnvironment(origin, scene, "");
        FAIL() << "nothing was thrown";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("maps/sky.hdr"));
        EXPECT_THAT(error.what(), testing::HasSubstr("--environment"));
    }
    std::filesystem::create_directory(folder.path() / "maps");
    std::ofstream(folder.path() / "maps" / "sky.hdr") << "x";
    EXPECT_EQ(FindEnvironment(origin, scene, ""), (folder.path() / "maps" / "sky.hdr").string());
    origin.settings.environment.clear();
    EXPECT_EQ(FindEnvironment(origin, scene, ""), "");
    EXPECT_THROW(FindEnvironment(origin, scene, "sky.hdr"), Error);
}

}  // namespace
}  // namespace relume::client
