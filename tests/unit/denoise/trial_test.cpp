// Filters tried on held-out samples.
#include "server/denoise/trial.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "server/denoise/denoiser.h"
#include "server/denoise/error_estimate.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

double MeanOf(const Judge::Errors& errors) {
    double mean = 0;
    for (const double e : errors) {
        mean += e / static_cast<double>(errors.size());
    }
    return mean;
}

// What a filter would make of the truth whose errors are of that standard deviation.
Trial::Run MakeRun(const Trial& trial, const Truth& truth, float deviation, unsigned run) {
    Trial::Run out;
    std::mt19937 random(100 + run);
    for (int k = 0; k < 2; ++k) {
        auto& windows = out.halves.emplace_back();
        for (const Trial::Window& window : trial.windows()) {
            auto& half = windows.emplace_back().color;
            const int width = window.part.frame.width;
            for (std::size_t c = 0; c < 3; ++c) {
                half[c].resize(window.part.frame.pixel_count());
                for (std::size_t i = 0; i < half[c].size(); ++i) {
                    const int x = static_cast<int>(i) % width, y = static_cast<int>(i) / width;
                    half[c][i] = truth.Color(x, y)[static_cast<int>(c)] +
                                 deviation * static_cast<float>(Normal(&random));
                }
            }
        }
    }
    return out;
}

TEST(Trial, WhatItMadeOfWindowsIsNotMadeAgainForTheEstimate) {
    for (const auto& [width, height] : {std::pair{640, 360}, {960, 640}}) {
        const Frame frame = FrameFromFilm(MakeFilm({width, height}, 4, 12));
        const Trial trial(frame);
        const std::vector<TileRect> judged = WindowsToJudge(frame);
        const auto robust = MakeDenoiser("bilateral:mode=robust");
        std::vector<WindowError> known =
            trial.JudgeWindows(trial.Filter(*robust, 2, CancelToken()));
        EXPECT_EQ(known.size(), trial.windows().size());
        for (const WindowError& error : known) {
            EXPECT_EQ(std::ranges::count(judged, error.window), 1);
        }
        const auto fresh = EstimateByHalves(*robust, frame, CancelToken());
        const auto estimate = EstimateByHalves(*robust, frame, CancelToken(), known);
        ASSERT_TRUE(fresh && estimate);
        EXPECT_EQ(estimate->relmse, fresh->relmse);
        EXPECT_EQ(estimate->low, fresh->low);
        EXPECT_EQ(estimate->high, fresh->high);
        EXPECT_EQ(estimate->unfiltered, fresh->unfiltered);
        known[0].relmse += 1;
        EXPECT_NEAR(EstimateByHalves(*robust, frame, CancelToken(), known)->relmse - fresh->relmse,
                    1.0 / static_cast<double>(judged.size()), 1e-9);
    }
}

TEST(Trial, AChoicesEstimateIsThatOfItsBase) {
    const Frame frame = FrameFromFilm(MakeFilm({640, 360}, 8, 13));
    const auto choice = MakeDenoiser("auto:effort=0.6")->Choose(frame, CancelToken());
    ASSERT_TRUE(choice && choice->base);
    EXPECT_FALSE(choice->base_windows.empty());
    const auto estimate = EstimateChosen(*choice, frame, CancelToken());
    const auto base = EstimateByHalves(*choice->base, frame, CancelToken());
    ASSERT_TRUE(estimate && base);
    EXPECT_EQ(estimate->relmse, base->relmse * choice->over_base);
}

// By one half, and by both.
class Judges : public testing::TestWithParam<int> {
  protected:
    // One window: of that size the frame is tried whole.
    Truth truth_{144, 128};
    Frame frame_ = FrameFromFilm(MakeFilm(truth_, 16, 11));
    Trial trial_{frame_};
};

TEST_P(Judges, EstimateTheErrorThatThereIs) {
    const auto robust = MakeDenoiser("bilateral:mode=robust");
    const Trial::Run run = trial_.Filter(*robust, 2, CancelToken());
    const Trial::Run* const runs[] = {&run};
    const Judge judge(trial_, runs, 2);
    const Result result = RunDenoiser(*robust, frame_, CancelToken());
    const auto relmse = [&](const Plane(&image)[3]) {
        double sum = 0;
        for (int y = 0; y < truth_.height; ++y) {
            for (int x = 0; x < truth_.width; ++x) {
                for (int c = 0; c < 3; ++c) {
                    const double r = truth_.Color(x, y)[c];
                    const double d = image[c][static_cast<std::size_t>(y * truth_.width + x)] - r;
                    sum += d * d / (r * r + 0.01) / 3;
                }
            }
        }
        return sum / (truth_.width * truth_.height);
    };
    const Judge::Errors errors = judge.Of(run), noisy = judge.OfNone();
    EXPECT_NEAR(MeanOf(errors) / relmse(result.color), 1, 0.35);
    EXPECT_NEAR(MeanOf(noisy) / relmse(frame_.color), 1, 0.1);
    const Judge::Difference difference = Judge::Compare(noisy, errors);
    EXPECT_GT(difference.mean, 3 * difference.error);
    EXPECT_FALSE(difference.Holds(1));
    EXPECT_TRUE(Judge::Compare(errors, errors).Holds(0));
}

TEST_P(Judges, TellsRunsApartByTheirErrors) {
    const Trial::Run fine = MakeRun(trial_, truth_, 0.06f, 1);
    const Trial::Run coarse = MakeRun(trial_, truth_, 0.12f, 2);
    const Trial::Run* const runs[] = {&fine, &coarse};
    const Judge judge(trial_, runs, GetParam());
    EXPECT_NEAR(MeanOf(judge.Of(fine)) / MeanOf(judge.Of(coarse)), 0.25, 0.1);
    const Judge::Difference gain = Judge::Compare(judge.Of(fine), judge.Of(coarse));
    EXPECT_LT(gain.mean, -3 * gain.error);
}

INSTANTIATE_TEST_SUITE_P(Halves, Judges, testing::Values(1, 2));

TEST(Judge, OneBlockDoesNotDecide) {
    Judge::Errors a(100, 0.01), b(100, 0.011);
    a[17] = 50;
    const Judge::Difference difference = Judge::Compare(a, b);
    EXPECT_LT(difference.mean, 0);
    EXPECT_TRUE(difference.Holds(1));
}

TEST(Judge, WhatCantBeToldApartHoldsUnlessItSeemsToCostTooMuch) {
    Judge::Errors a(100, 0.01), b(100, 0.01);
    for (std::size_t i = 0; i < a.size(); ++i) {
        a[i] += i % 2 == 0 ? 0.021 : -0.019;  // worse by a tenth, give or take a fifth
    }
    const Judge::Difference difference = Judge::Compare(a, b);
    EXPECT_NEAR(difference.mean, 0.001, 1e-9);
    EXPECT_NEAR(difference.error, 0.002, 1e-4);
    EXPECT_TRUE(difference.Holds(0.2));
    EXPECT_FALSE(difference.Holds(0.05));
}

}  // namespace
}  // namespace relume::denoise
