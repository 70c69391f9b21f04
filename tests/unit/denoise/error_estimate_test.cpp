#include "server/denoise/error_estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "server/denoise/halves.h"
#include "server/denoise/yardstick.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

constexpr Truth kTruth{96, 64};

// Mean over pixels and RGB of (test - truth)^2 / (truth^2 + 0.01).
double RelMSE(const Plane (&test)[3]) {
    double sum = 0;
    for (int y = 0; y < kTruth.height; ++y) {
        for (int x = 0; x < kTruth.width; ++x) {
            const Rgb truth = kTruth.Color(x, y);
            for (int c = 0; c < 3; ++c) {
                const double d = test[c][static_cast<std::size_t>(y * kTruth.width + x)] - truth[c];
                sum += d * d / (truth[c] * truth[c] + 0.01);
            }
        }
    }
    return sum / (3.0 * kTruth.width * kTruth.height);
}

TEST(ErrorEstimate, TellsTheErrorOfTheUnfilteredImage) {
    for (const unsigned seed : {1u, 2u, 3u}) {
        const Frame frame = FrameFromFilm(MakeFilm(kTruth, 16, seed));
        const ErrorEstimate estimate = EstimateNoisy(frame);
        const double truth = RelMSE(frame.color);
        // 6144 pixels, each known to 1.4 times its size or so: 2 %; four of that.
        EXPECT_NEAR(estimate.relmse / truth, 1, 0.08);
        EXPECT_LT(estimate.low, truth);
        EXPECT_GT(estimate.high, truth);
    }
}

TEST(ErrorEstimate, TellsTheErrorOfTheFilteredImage) {
    for (const char* filter : {"bilateral:mode=corrected", "bilateral:mode=robust"}) {
        const auto denoiser = MakeDenoiser(filter);
        for (const int spp : {8, 64}) {
            const Frame frame = FrameFromFilm(MakeFilm(kTruth, spp, 4));
            const Result result = RunDenoiser(*denoiser, frame, CancelToken());
            const auto estimate = EstimateFiltered(*denoiser, frame, result, CancelToken());
            ASSERT_TRUE(estimate);
            const double truth = RelMSE(result.color);
            EXPECT_GT(estimate->high, truth) << filter << spp;
            // What a half's filter blurs the whole's may not: too high, here by up to three times.
            EXPECT_LT(estimate->relmse, 4 * truth) << filter << spp;
            if (spp == 8) {
                EXPECT_LT(estimate->low, truth) << filter;
            }
            // And says something: the filter's error is far below the noise.
            EXPECT_LT(estimate->high, 0.5 * RelMSE(frame.color)) << filter << spp;
        }
    }
}

TEST(ErrorEstimate, OfAnImageWithoutNoiseIsZero) {
    Frame frame = FrameFromFilm(MakeFilm(kTruth, 8, 1, [](int x, int y, int, PixelSample* sample) {
        sample->radiance = kTruth.Color(x, y);
    }));
    const ErrorEstimate estimate = EstimateNoisy(frame);
    EXPECT_NEAR(estimate.relmse, 0, 1e-9);
    EXPECT_NEAR(estimate.high, 0, 1e-6);
}

TEST(ErrorEstimate, ClaimsAreWrittenAndTakenBack) {
    std::map<std::string, std::string> metadata{{"other", "1"}};
    const ErrorEstimate estimate{0.5, 0.25, 0.75, {}};
    WriteClaim("key", &estimate, &metadata);
    EXPECT_EQ(metadata.at("key"), "0.5");
    EXPECT_EQ(metadata.at("key_interval"), "0.25 0.75");
    WriteClaim("key", nullptr, &metadata);
    EXPECT_EQ(metadata.size(), 1u);
}

TEST(Yardstick, IsNotThePixelThatIsBrightByChance) {
    const std::size_t here = 32 * 96 + 20;
    const Frame calm = FrameFromFilm(MakeFilm(kTruth, 8, 1));
    const Frame hit =
        FrameFromFilm(MakeFilm(kTruth, 8, 1, [](int x, int y, int index, PixelSample* s) {
            if (x == 20 && y == 32 && index == 3) {
                s->radiance = {1e4f, 1e4f, 1e4f};
            }
        }));
    const auto before = SquaredYardstick(calm), after = SquaredYardstick(hit);
    EXPECT_EQ(after[0][here], before[0][here]);
    EXPECT_GT(after[0][here + 1], 100 * before[0][here + 1]);
}

TEST(Halves, AreFramesOfTheirOwn) {
    const Frame frame = FrameFromFilm(MakeFilm(kTruth, 8, 1));
    for (const int half : {0, 1}) {
        const Frame one = HalfFrame(frame, half);
        EXPECT_EQ(one.color[1], frame.half[half][1]);
        EXPECT_FALSE(one.has_halves());
        EXPECT_EQ(one.count[100], 4);
        EXPECT_FLOAT_EQ(one.variance[2][100], 2 * frame.variance[2][100]);
    }
}

TEST(Halves, ShrinkByMeansOfBlocks) {
    Frame frame = FrameFromFilm(MakeFilm({7, 5}, 4, 1));
    std::iota(frame.color[0].begin(), frame.color[0].end(), 0.0f);
    std::fill(frame.variance[0].begin(), frame.variance[0].end(), 8.0f);
    const Frame small = ShrinkFrame(frame);
    EXPECT_EQ(small.width, 4);
    EXPECT_EQ(small.height, 3);
    EXPECT_FLOAT_EQ(small.color[0][0], 4);    // 0, 1, 7, 8
    EXPECT_FLOAT_EQ(small.color[0][11], 34);  // the last pixel alone
    EXPECT_FLOAT_EQ(small.variance[0][0], 2);
    EXPECT_FLOAT_EQ(small.variance[0][11], 8);
    EXPECT_FLOAT_EQ(small.count[0], 16);
    EXPECT_TRUE(small.has_halves());
}

TEST(Halves, DisagreeWhereTheFilteredOnesDiffer) {
    FilteredHalves halves;
    for (auto& half : halves.color) {
        half.fill(Plane(2, 1.0f));
    }
    halves.color[0][0][1] = 2;
    const Plane differ = Disagreement(halves);
    EXPECT_EQ(differ[0], 0);
    EXPECT_NEAR(differ[1], 1 / (1.5 * 1.5 + 1e-3) / 3, 1e-6);
}

}  // namespace
}  // namespace relume::denoise
