#include "server/denoise/fireflies.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "server/denoise/denoiser.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

constexpr int kWidth = 40, kHeight = 30;
constexpr std::size_t kFirefly = 15 * kWidth + 20;

// Grey, with a little noise, and one sample of the middle pixel, in its half b, a thousand times as
// bright.
Frame WithFirefly() {
    return FrameFromFilm(
        MakeFilm({kWidth, kHeight}, 8, 3, [](int x, int y, int index, PixelSample* sample) {
            const float noise = 0.9f + 0.05f * static_cast<float>((x * 7 + y * 3 + index) % 5);
            sample->radiance = {0.5f * noise, 0.5f * noise, 0.5f * noise};
            if (x == 20 && y == 15 && index == 3) {
                sample->radiance = {500, 500, 500};
            }
            sample->indirect_luminance = sample->radiance.x;
        }));
}

double Sum(const Plane& plane) { return std::accumulate(plane.begin(), plane.end(), 0.0); }

TEST(Fireflies, AreSpreadAndKeepTheirEnergy) {
    const Frame before = WithFirefly();
    Frame frame = before;
    EXPECT_EQ(SpreadFireflies(&frame), 1u);
    for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(Sum(frame.color[c]) / Sum(before.color[c]), 1, 1e-5);
        EXPECT_NEAR(Sum(frame.half[1][c]) / Sum(before.half[1][c]), 1, 1e-5);
        EXPECT_GT(before.color[c][kFirefly], 60);
        // A 49th of it, on what was there.
        EXPECT_NEAR(frame.color[c][kFirefly], 0.5f + 62 / 49.0f, 0.1f);
        EXPECT_EQ(frame.half[0][c], before.half[0][c]);
        EXPECT_LT(frame.half[1][c][kFirefly], 4);
        EXPECT_LT(frame.variance[c][kFirefly], before.variance[c][kFirefly] * 1e-2f);
        // Nothing beyond 3 pixels.
        EXPECT_EQ(frame.color[c][kFirefly + 4], before.color[c][kFirefly + 4]);
        EXPECT_GT(frame.color[c][kFirefly + 3], before.color[c][kFirefly + 3] + 1);
    }
}

TEST(Fireflies, WhatIsBrightByAllItsSamplesStays) {
    const auto lamp = [](int x, int y, int, PixelSample* sample) {
        const bool lit = x == 20 && y == 15;
        sample->radiance = lit ? Rgb{60, 60, 60} : Rgb{0.5f, 0.5f, 0.5f};
        sample->indirect_luminance = sample->radiance.x;
    };
    const Frame before = FrameFromFilm(MakeFilm({kWidth, kHeight}, 8, 3, lamp));
    Frame frame = before;
    EXPECT_EQ(SpreadFireflies(&frame), 0u);
    EXPECT_EQ(frame.color[1], before.color[1]);
}

TEST(Fireflies, StayWhereTheBrightestSampleIsNotKnown) {
    Frame frame = WithFirefly();
    frame.brightest.clear();
    const Plane before = frame.color[0];
    EXPECT_EQ(SpreadFireflies(&frame), 0u);
    EXPECT_EQ(frame.color[0], before);
}

TEST(Fireflies, AnyFilterCanSpreadThemFirst) {
    const Frame frame = WithFirefly();
    const auto spread = MakeDenoiser("none:fireflies=spread");
    EXPECT_EQ(spread->Describe(), "none:fireflies=spread");
    EXPECT_LT(RunDenoiser(*spread, frame, CancelToken()).color[0][kFirefly], 3);
    EXPECT_GT(RunDenoiser(*MakeDenoiser("none"), frame, CancelToken()).color[0][kFirefly], 60);
}

}  // namespace
}  // namespace relume::denoise
