#include "server/denoise/noisy_part.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server/denoise/crop_frame.h"
#include "server/denoise/filter_frame.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr const char* kRobust = "bilateral:mode=robust";
constexpr Truth kTruth{256, 160};
constexpr TileRect kNoisy{90, 30, 180, 120};

bool IsIn(const TileRect& rect, int x, int y) {
    return x >= rect.x0 && x < rect.x1 && y >= rect.y0 && y < rect.y1;
}

// The truth with noise inside of `noisy` alone.
Frame FrameNoisyIn(const TileRect& noisy, int spp, unsigned seed) {
    return FrameFromFilm(MakeFilm(kTruth, spp, seed, [&](int x, int y, int, PixelSample* sample) {
        if (!IsIn(noisy, x, y)) {
            sample->radiance = kTruth.Color(x, y);
        }
    }));
}

std::vector<int> Sides(const TileRect& r) { return {r.x0, r.y0, r.x1, r.y1}; }

TEST(NoisyPart, IsWhereTheNoiseIsAndAMargin) {
    const TileRect rect = FindNoisyPart(FrameNoisyIn(kNoisy, 8, 1));
    // The frame's own variance is pooled over some pixels around: it may reach a little further,
    // and what has a thousandth of the noise may be cut.
    const std::vector<int> expected = {kNoisy.x0 - 8, kNoisy.y0 - 8, kNoisy.x1 + 8, kNoisy.y1 + 8};
    for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_NEAR(Sides(rect)[k], expected[k], 4) << k;
    }
}

TEST(NoisyPart, IsTheWholeFrameWhereThereIsNoiseOrNoneAllOver) {
    const TileRect all{0, 0, kTruth.width, kTruth.height}, none{0, 0, 0, 0};
    for (const TileRect& noisy : {all, none}) {
        const Frame frame = FrameNoisyIn(noisy, 8, 2);
        EXPECT_TRUE(IsWhole(FindNoisyPart(frame), frame));
    }
}

TEST(NoisyPart, IsNotLessForAFirefly) {
    Frame frame = FrameNoisyIn({0, 0, kTruth.width, kTruth.height}, 8, 3);
    for (Plane& variance : frame.variance) {
        variance[5000] = 1e12f;
    }
    EXPECT_TRUE(IsWhole(FindNoisyPart(frame), frame));
}

TEST(NoisyPart, IsNeverTooSmallToFilter) {
    const TileRect corner = FindNoisyPart(FrameNoisyIn({250, 150, 256, 160}, 8, 4));
    EXPECT_EQ(Sides(corner), (std::vector<int>{192, 96, 256, 160}));
    for (const auto& [width, height] : {std::pair{1, 1}, {300, 1}, {3, 200}}) {
        const Truth thin{width, height};
        const Frame frame = FrameFromFilm(MakeFilm(thin, 4, 1, [&](int x, int y, int, auto* s) {
            if (x > 0 || y > 0) {
                s->radiance = thin.Color(x, y);
            }
        }));
        const TileRect rect = FindNoisyPart(frame);
        EXPECT_EQ(rect.x0, 0);
        EXPECT_EQ(rect.y0, 0);
        EXPECT_GE(rect.width(), std::min(width, 64));
        EXPECT_GE(rect.height(), std::min(height, 64));
        EXPECT_LE(rect.width(), width);
        EXPECT_LE(rect.height(), height);
    }
}

TEST(NoisyPart, TheRestStaysAsItIs) {
    const Frame frame = FrameNoisyIn(kNoisy, 8, 5);
    const TileRect rect = FindNoisyPart(frame);
    const auto denoiser = MakeDenoiser(std::string(kRobust) + ",where=noisy");
    EXPECT_EQ(denoiser->Describe(), std::string(kRobust) + ",where=noisy");
    const Result result = RunDenoiser(*denoiser, frame, CancelToken());
    const Result part = RunDenoiser(*MakeDenoiser(kRobust), CropFrame(frame, rect), CancelToken());
    EXPECT_THAT(result.notes.at("where"), HasSubstr("%"));
    for (int y = 0; y < frame.height; ++y) {
        for (int x = 0; x < frame.width; ++x) {
            const auto i = static_cast<std::size_t>(y * frame.width + x);
            const bool inside = IsIn(rect, x, y);
            const auto k =
                static_cast<std::size_t>(inside ? (y - rect.y0) * rect.width() + x - rect.x0 : 0);
            for (std::size_t c = 0; c < 3; ++c) {
                ASSERT_EQ(result.color[c][i], inside ? part.color[c][k] : frame.color[c][i]);
                ASSERT_EQ((*result.derivative)[c][i], inside ? (*part.derivative)[c][k] : 1.0f);
            }
            if (inside) {
                ASSERT_EQ((*result.error)[i], (*part.error)[k]);
            }
        }
    }
}

TEST(NoisyPart, AnEstimateIsOfTheWholeFrame) {
    const Frame frame = FrameNoisyIn(kNoisy, 8, 6);
    for (const char* filter : {"bilateral:mode=robust", "auto", "auto:effort=0.6"}) {
        const std::string name = filter;
        const Filtered made =
            FilterFrame(name + (name == kRobust ? ",where=noisy" : ""), frame, CancelToken());
        const Filtered whole = FilterFrame(kRobust, frame, CancelToken());
        ASSERT_TRUE(made.error && whole.error);
        EXPECT_NEAR(made.error->unfiltered / whole.error->unfiltered, 1, 0.1) << filter;
        EXPECT_LT(made.error->relmse, 1.3 * whole.error->relmse) << filter;
        EXPECT_EQ(made.error->map.size(), frame.pixel_count());
        double truth = 0;
        for (int y = 0; y < frame.height; ++y) {
            for (int x = 0; x < frame.width; ++x) {
                const Rgb color = kTruth.Color(x, y);
                for (int c = 0; c < 3; ++c) {
                    const double d =
                        made.result.color[c][static_cast<std::size_t>(y * frame.width + x)] -
                        color[c];
                    truth += d * d / (color[c] * color[c] + 0.01) / 3;
                }
            }
        }
        truth /= static_cast<double>(frame.pixel_count());
        EXPECT_LT(made.error->low, truth) << filter;
        EXPECT_GT(made.error->high, truth) << filter;
    }
}

TEST(NoisyPart, AutoLooksAtNoMore) {
    const Frame frame = FrameNoisyIn(kNoisy, 16, 7);
    const Filtered filtered = FilterFrame("auto", frame, CancelToken());
    EXPECT_THAT(filtered.filter, HasSubstr(",where=noisy"));
    EXPECT_EQ(MakeDenoiser(filtered.filter)->Describe(), filtered.filter);
    EXPECT_EQ(std::ranges::count(filtered.choice->candidates, filtered.filter,
                                 &Choice::Candidate::filter),
              1);
    // What the choice was is all that it takes to do it again.
    const Result again = RunDenoiser(*MakeDenoiser(filtered.filter), frame, CancelToken());
    for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(again.color[c], filtered.result.color[c]);
        EXPECT_EQ(filtered.result.color[c][0], frame.color[c][0]);
    }
    const Frame all = FrameNoisyIn({0, 0, kTruth.width, kTruth.height}, 16, 7);
    EXPECT_THAT(FilterFrame("auto", all, CancelToken()).filter, Not(HasSubstr("where")));
}

TEST(NoisyPart, RefusesFiltersOfSamples) {
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("rpf:where=noisy"); }),
                HasSubstr("leave where=noisy out"));
}

}  // namespace
}  // namespace relume::denoise
