#include "core/image/png_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/decode.h"

namespace relume {
namespace {

using testing::ElementsAre;

Image Colors() {
    Image image(2, 2, {"R", "G", "B", "Z", "noisy.R", "noisy.G", "noisy.B", "samples.Y"});
    const float red[] = {0, 1, 0.5f, 7}, green[] = {0, 0.002f, 0.18f, -1};
    for (std::size_t i = 0; i < 4; ++i) {
        image.Plane("R")[i] = red[i];
        image.Plane("G")[i] = green[i];
        image.Plane("noisy.B")[i] = 1;
        image.Plane("Z")[i] = static_cast<float>(i) * 10;
        image.Plane("samples.Y")[i] = 4;
    }
    return image;
}

std::vector<int> View(const Image& image, const std::string& layer = "", float exposure = 0) {
    const DecodedImage decoded = DecodeImage(EncodePngView(image, layer, exposure), "view.png");
    EXPECT_EQ(decoded.width, image.width());
    EXPECT_EQ(decoded.height, image.height());
    EXPECT_EQ(decoded.channels, 3);
    return {decoded.bytes.begin(), decoded.bytes.end()};
}

TEST(PngView, EncodesSrgbAndClamps) {
    // sRGB of 0.5 is 187.5, of 0.18 is 117.6, of 0.002 is 6.6 (the linear part of the curve).
    EXPECT_THAT(View(Colors()), ElementsAre(0, 0, 0, 255, 7, 0, 188, 118, 0, 255, 0, 0));
}

TEST(PngView, ExposureIsInStops) {
    EXPECT_THAT(View(Colors(), "", 1), ElementsAre(0, 0, 0, 255, 13, 0, 255, 162, 0, 255, 0, 0));
    EXPECT_THAT(View(Colors(), "", -1)[3], 188);
}

TEST(PngView, ShowsALayer) {
    EXPECT_THAT(View(Colors(), "noisy"), ElementsAre(0, 0, 255, 0, 0, 255, 0, 0, 255, 0, 0, 255));
}

TEST(PngView, ASingleChannelIsGreyScaledToItsLargest) {
    // sRGB of 1/3 and 2/3.
    const auto grey = ElementsAre(0, 0, 0, 156, 156, 156, 213, 213, 213, 255, 255, 255);
    EXPECT_THAT(View(Colors(), "Z"), grey);
    EXPECT_THAT(View(Colors(), "samples"), testing::Each(255));
    EXPECT_THAT(View(Colors(), "samples.Y"), testing::Each(255));
    EXPECT_THAT(View(Image(2, 1, {"Z"}), "Z"), testing::Each(0));
}

TEST(PngView, NonFinitePixelsAreMagenta) {
    Image image(3, 1, {"R", "G", "B", "Z"});
    image.Plane("G")[0] = std::numeric_limits<float>::quiet_NaN();
    image.Plane("B")[2] = -std::numeric_limits<float>::infinity();
    image.Plane("Z")[0] = std::numeric_limits<float>::infinity();
    image.Plane("Z")[1] = 2;
    EXPECT_THAT(View(image), ElementsAre(255, 0, 255, 0, 0, 0, 255, 0, 255));
    EXPECT_THAT(View(image, "Z"), ElementsAre(255, 0, 255, 255, 255, 255, 0, 0, 0));
}

TEST(PngView, OfACropShowsTheDataWindow) {
    Image image = Colors();
    image.SetWindow(10, 20, 640, 480);
    EXPECT_EQ(View(image), View(Colors()));
}

TEST(PngView, AnUnknownLayerIsAnsweredWithTheChannels) {
    try {
        EncodePngView(Colors(), "nosy");
        FAIL() << "nothing was thrown";
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
        EXPECT_THAT(e.what(), testing::HasSubstr("'nosy'"));
        EXPECT_THAT(e.what(), testing::HasSubstr("noisy.R"));
    }
    EXPECT_THROW(EncodePngView(Image(0, 0, {"R", "G", "B"})), Error);
}

TEST(PngView, BytesAreTheSameEachTimeAndReachTheFile) {
    const TemporaryFolder folder;
    WritePngView(folder.path() / "view.png", Colors(), "Z");
    EXPECT_EQ(ReadFile(folder.path() / "view.png"), EncodePngView(Colors(), "Z"));
}

}  // namespace
}  // namespace relume
