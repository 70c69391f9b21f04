#include <cmath>

#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(Environment, HdrMapBecomesTheScenesEnvironment) {
    MapSource files = TriangleFile().Files();
    files.files["sky.hdr"] = HdrPicture(4, 2, 128, 64, 0, 129);
    LoadOptions options;
    options.environment = "sky.hdr";
    options.environment_scale = 2.5f;
    const Scene scene = Load(files, options);
    ASSERT_NE(scene.environment, nullptr);
    EXPECT_EQ(scene.environment->color, (Rgb{2.5f, 2.5f, 2.5f}));
    EXPECT_TRUE(scene.HasLight());
    const SceneImage& image = scene.images.at(static_cast<std::size_t>(scene.environment->image));
    EXPECT_EQ(image.name, "sky.hdr");
    EXPECT_EQ(image.width, 4);
    EXPECT_EQ(image.height, 2);
    ASSERT_EQ(image.floats.size(), 24u);
    EXPECT_EQ(image.floats[0], 1);  // 128 / 256 * 2^(129 - 128)
    EXPECT_EQ(image.floats[1], 0.5f);
}

TEST(Environment, EightBitMapsAreMadeLinear) {
    MapSource files = TriangleFile().Files();
    files.files["sky.tga"] = TgaPicture(2, 1, 255, 188, 0);
    LoadOptions options;
    options.environment = "sky.tga";
    const Scene scene = Load(files, options);
    const SceneImage& image = scene.images.at(static_cast<std::size_t>(scene.environment->image));
    EXPECT_TRUE(image.bytes.empty());
    ASSERT_EQ(image.floats.size(), 6u);
    EXPECT_FLOAT_EQ(image.floats[0], 1);
    EXPECT_NEAR(image.floats[1], 0.503f, 0.001f);  // 188 is the middle grey of sRGB
    EXPECT_EQ(image.floats[2], 0);
}

TEST(Environment, PreflightLooksAtTheHeaderAlone) {
    MapSource files = TriangleFile().Files();
    files.files["sky.hdr"] = HdrPicture(4, 2, 128, 64, 0, 129);
    const Scene scene = Load(files, {.decode_images = false, .environment = "sky.hdr"});
    EXPECT_EQ(scene.images.at(0).width, 4);
    EXPECT_TRUE(scene.images.at(0).floats.empty());
}

TEST(Environment, ErrorsNameTheMap) {
    MapSource files = TriangleFile().Files();
    EXPECT_THAT(MessageOf([&] { Load(files, {.environment = "sky.hdr"}); }),
                AllOf(HasSubstr("environment map"), HasSubstr("sky.hdr: missing")));
    files.files["sky.hdr"] = "not a picture";
    EXPECT_THAT(MessageOf([&] { Load(files, {.environment = "sky.hdr"}); }),
                AllOf(HasSubstr("environment map"), HasSubstr("sky.hdr")));
    files.files["sky.hdr"] = HdrPicture(4, 2, 128, 64, 0, 129);
    for (const float scale : {-1.0f, std::nanf("")}) {
        EXPECT_THAT(
            MessageOf([&] { Load(files, {.environment = "sky.hdr", .environment_scale = scale}); }),
            HasSubstr("environment scale"));
    }
}

TEST(Environment, AScaleOfZeroIsNoLight) {
    MapSource files = TriangleFile().Files();
    files.files["sky.hdr"] = HdrPicture(4, 2, 128, 64, 0, 129);
    EXPECT_FALSE(Load(files, {.environment = "sky.hdr", .environment_scale = 0}).HasLight());
}

}  // namespace
}  // namespace relume::test
