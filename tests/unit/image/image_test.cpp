#include "core/image/image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/error.h"

namespace relume {
namespace {

Image TwoChannels(const std::string& first, const std::string& second) {
    Image image(3, 2, {first, second});
    for (std::size_t i = 0; i < image.pixel_count(); ++i) {
        image.Plane("R")[i] = static_cast<float>(i);
        image.Plane("Z")[i] = -static_cast<float>(i);
    }
    return image;
}

TEST(Image, PlanesBeginBlackAndCoverTheWindow) {
    const Image image(3, 2, {"R", "albedo.G"});
    EXPECT_EQ(image.pixel_count(), 6u);
    EXPECT_EQ(image.display_width(), 3);
    EXPECT_EQ(image.Find("albedo.G"), 1);
    EXPECT_EQ(image.Find("G"), -1);
    EXPECT_THAT(image.Plane("R"), testing::Each(0.0f));
    EXPECT_EQ(image.Plane("R").size(), 6u);
}

TEST(Image, AMissingChannelIsAnsweredWithThoseThereAre) {
    const Image image(1, 1, {"R", "Z"});
    try {
        image.Plane("G");
        FAIL() << "nothing was thrown";
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::kNotFound);
        EXPECT_THAT(e.what(), testing::HasSubstr("'G'; it has R, Z"));
    }
}

TEST(Image, AChannelIsAddedOnce) {
    Image image(1, 1, {"R"});
    EXPECT_EQ(image.Add("G"), 1);
    EXPECT_THROW(image.Add("R"), Error);
    EXPECT_THROW(Image(1, 1, {"R", "R"}), Error);
}

TEST(ImageDigest, DoesNotDependOnTheOrderOfChannelsOrOnMetadata) {
    Image one = TwoChannels("R", "Z");
    const Image other = TwoChannels("Z", "R");
    one.metadata()["host"] = "a";
    EXPECT_EQ(ImageDigest(one), ImageDigest(other));
    EXPECT_EQ(ImageDigest(one).size(), 64u);
}

TEST(ImageDigest, DependsOnEveryBitNameAndWindow) {
    const Image image = TwoChannels("R", "Z");
    const std::string digest = ImageDigest(image);
    Image changed = image;
    changed.Plane("R")[0] = -0.0f;
    EXPECT_NE(ImageDigest(changed), digest);
    changed = image;
    changed.SetWindow(1, 0, 3, 2);
    EXPECT_NE(ImageDigest(changed), digest);
    changed = image;
    changed.SetWindow(0, 0, 4, 2);
    EXPECT_NE(ImageDigest(changed), digest);
    changed = image;
    changed.Add("A");
    EXPECT_NE(ImageDigest(changed), digest);
    EXPECT_NE(ImageDigest(Image(3, 2, {"R"})), ImageDigest(Image(2, 3, {"R"})));
    EXPECT_NE(ImageDigest(Image(3, 2, {"R"})), ImageDigest(Image(3, 2, {"G"})));
}

}  // namespace
}  // namespace relume
