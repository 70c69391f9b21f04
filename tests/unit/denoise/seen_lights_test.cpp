#include "server/denoise/seen_lights.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server/denoise/channel_names.h"
#include "server/denoise/error_estimate.h"
#include "server/denoise/filter_frame.h"
#include "server/denoise/output_image.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

constexpr int kWidth = 64, kHeight = 48, kX = 30, kY = 20;
constexpr std::size_t kLamp = kY * kWidth + kX;
constexpr float kLampLight = 5000;

// A grey wall with a noise of a third, and before it a lamp that every third sample of one pixel
// meets. `indirect`: as a lamp that some paths find by chance would look.
Frame WallWithLamp(bool indirect = false) {
    return FrameFromFilm(MakeFilm(
        {kWidth, kHeight}, 12, 3, [indirect](int x, int y, int index, PixelSample* sample) {
            const unsigned mixed =
                (73856093u * static_cast<unsigned>(x) ^ 19349663u * static_cast<unsigned>(y) ^
                 83492791u * static_cast<unsigned>(index)) *
                2654435761u;
            const float wall = 0.1f + 0.2f * static_cast<float>(mixed >> 16) / 65536;
            const bool lit = x == kX && y == kY && index % 3 == 0;
            sample->radiance = Rgb{1, 1, 1} * (lit ? kLampLight : wall);
            sample->indirect_luminance = lit && !indirect ? 0 : sample->radiance.x;
            for (float& feature : sample->features) {
                feature = 0.5f;
            }
        }));
}

float BrightestElsewhere(const Plane& plane) {
    float most = 0;
    for (std::size_t i = 0; i < plane.size(); ++i) {
        most = i == kLamp ? most : std::max(most, plane[i]);
    }
    return most;
}

TEST(SeenLights, AreFoundByTheirNoiseAlone) {
    const Frame frame = WallWithLamp();
    const auto found = FindSeenLights(frame);
    ASSERT_EQ(found.size(), frame.pixel_count());
    EXPECT_EQ(found[kLamp], 1);
    EXPECT_EQ(std::count(found.begin(), found.end(), 1), 1);
    EXPECT_TRUE(FindSeenLights(WallWithLamp(true)).empty());
    Frame unknown = frame;
    unknown.brightest.clear();
    EXPECT_TRUE(FindSeenLights(unknown).empty());
    Frame sure = frame;  // a lamp that fills its pixel
    for (Plane& variance : sure.variance) {
        variance[kLamp] = 0;
    }
    EXPECT_TRUE(FindSeenLights(sure).empty());
}

class Kept : public testing::TestWithParam<const char*> {};

TEST_P(Kept, TheLampStaysInItsPixel) {
    const Frame frame = WallWithLamp();
    const Result result = RunDenoiser(*MakeDenoiser(GetParam()), frame, CancelToken());
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(result.color[c][kLamp], frame.color[c][kLamp], 0.3f);
        EXPECT_LT(BrightestElsewhere(result.color[c]), 0.3f);
    }
    // A wall of 0.2 whose noise is lowered.
    EXPECT_NEAR(result.color[0][kLamp + 8], 0.2f, 0.02f);
    if (result.error) {
        EXPECT_GT((*result.error)[kLamp], 0.5f * frame.variance[0][kLamp]);
        EXPECT_LT((*result.error)[kLamp + 9], 1.0f);
    }
}
INSTANTIATE_TEST_SUITE_P(SeenLights, Kept,
                         testing::Values("bilateral:mode=robust", "nfor:lights=apart",
                                         "rd:lights=apart", "net:candidates=rd-nfor",
                                         "bilateral:mode=corrected,lights=apart,energy=restore"));

TEST(SeenLights, WithoutItTheLampIsSmeared) {
    const Result result =
        RunDenoiser(*MakeDenoiser("bilateral:mode=corrected"), WallWithLamp(), CancelToken());
    EXPECT_GT(BrightestElsewhere(result.color[0]), 10);
}

TEST(SeenLights, TheirHalvesDoNotSetTheNoiseOfTheSurroundings) {
    // Both halves have met the lamp alike: their difference there is that of the walls.
    const Frame frame = WallWithLamp();
    ASSERT_NEAR(frame.half[0][0][kLamp], frame.half[1][0][kLamp], 10);
    const float beside = frame.variance[0][kLamp + 2], far = frame.variance[0][2 * kWidth + 2];
    EXPECT_GT(beside, 0.2f * far);
    EXPECT_LT(beside, 5 * far);
}

TEST(SeenLights, AutoFiltersTheRestAndSaysWhatIsLeft) {
    const Filtered filtered = FilterFrame("auto:effort=0.1", WallWithLamp(), CancelToken());
    EXPECT_THAT(filtered.filter, testing::StartsWith("bilateral:mode=robust"));
    ASSERT_TRUE(filtered.error);
    EXPECT_LT(filtered.error->relmse, 0.3 * filtered.error->unfiltered);
    EXPECT_LT(BrightestElsewhere(filtered.result.color[0]), 0.3f);
}

TEST(SeenLights, AreFoundInAFileWithAllLayers) {
    const Frame frame = WallWithLamp();
    const Result result = RunDenoiser(*MakeDenoiser("none"), frame, CancelToken());
    std::vector<std::string> notes;
    const Frame read = FrameFromImage(AssembleLayers(frame, result, nullptr, true), &notes);
    EXPECT_EQ(read.brightest, frame.brightest);
    EXPECT_EQ(FindSeenLights(read), FindSeenLights(frame));
    EXPECT_TRUE(
        FrameFromImage(AssembleLayers(frame, result, nullptr, false), &notes).brightest.empty());
}

}  // namespace
}  // namespace relume::denoise
