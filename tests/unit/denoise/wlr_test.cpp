// Weighted local regression against its definition, what it must keep, and its planner.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/wlr_fit.h"
#include "tests/unit/denoise/reference_wlr.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

// Smooth colours and features with some noise, as much of it in the features as `noise` says.
Frame GentleFrame(int width, int height, unsigned seed, float noise) {
    Frame frame = MakeRandomFrame(width, height, seed);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        const auto x = static_cast<float>(i % static_cast<std::size_t>(width));
        const auto y = static_cast<float>(i / static_cast<std::size_t>(width));
        frame.count[i] = 1 + std::floor(frame.count[i]);
        for (int f = 0; f < kVisibility; ++f) {
            const float wave = std::sin(0.1f * static_cast<float>(f + 1) * x) +
                               std::cos(0.07f * static_cast<float>(8 - f) * y);
            frame.feature[f][i] = 0.5f * wave + 0.2f * frame.feature[f][i];
            frame.feature_variance[f][i] = noise * (1 + frame.color[0][i]);
        }
        frame.feature[kDepth][i] += 2;
        for (int c = 0; c < 3; ++c) {
            frame.color[c][i] = 0.3f * frame.color[c][i] + 0.4f + 0.2f * frame.feature[c][i];
        }
    }
    return frame;
}

class WlrKernelsTest : public testing::TestWithParam<float> {};

INSTANTIATE_TEST_SUITE_P(FeatureNoise, WlrKernelsTest, testing::Values(1e-4f, 0.1f, 3.0f));

TEST_P(WlrKernelsTest, FollowTheDefinition) {
    constexpr int kWidth = 67, kHeight = 36;
    const WlrInput input = MakeWlrInput(GentleFrame(kWidth, kHeight, 1, GetParam()));
    for (const int radius : {kWlrRadius, 5}) {
        std::vector<WlrCurves> curves(input.plane[0].size());
        ForEachWlrPixel(input, radius, BestWlrKernels(), {},
                        [&](std::size_t i, const WlrCurves& c) { curves[i] = c; });
        Plane bandwidth(curves.size());
        for (std::size_t i = 0; i < curves.size(); ++i) {
            bandwidth[i] = 0.3f + 0.05f * static_cast<float>(i % 15);
        }
        const auto fit = FitWlr(input, radius, bandwidth, BestWlrKernels(), {});
        int compared = 0;
        for (int y = 0; y < kHeight; y += 5) {
            for (int x = 0; x < kWidth; x += 3) {
                const auto i = static_cast<std::size_t>(y * kWidth + x);
                const ReferenceWlr reference(input, radius, x, y);
                if (reference.margin() < 1e-4) {
                    continue;  // single precision may see it on the other side
                }
                ++compared;
                ASSERT_EQ(curves[i].dimensions, reference.dimensions()) << x << ", " << y;
                const auto expected = reference.FitWith(bandwidth[i]);
                // Sums of floats; the coordinates have the rounding of the eigenvectors.
                for (std::size_t c = 0; c < 3; ++c) {
                    ASSERT_NEAR(fit[kWlrValue + c][i], expected.color[c], 2e-4) << x << ", " << y;
                }
                ASSERT_NEAR(fit[kWlrFitVariance][i], expected.variance,
                            2e-3 * expected.variance + 1e-6);
                WlrTrials trials{};
                for (int t = 0; t < kWlrTrials; ++t) {
                    const auto trial = reference.FitWith(TrialBandwidth(t));
                    for (int c = 0; c < 3; ++c) {
                        trials.change[t] += (trial.color[c] - input.plane[kWlrColor + c][i]) / 3;
                    }
                    trials.variance[t] = trial.variance;
                }
                trials.dimensions = reference.dimensions();
                trials.count = input.count[i];
                const WlrCurves exact = FitCurves(trials);
                ASSERT_NEAR(curves[i].bias, exact.bias, 1e-3);
                ASSERT_NEAR(curves[i].BestBandwidth(), exact.BestBandwidth(), 0.02);
            }
        }
        EXPECT_GT(compared, 150);
    }
}

TEST(WlrCurves, AreFoundAgainFromWhatTheySay) {
    const WlrCurves truth{0.2, -0.7, 0.001, 0.03, 4, 8};
    WlrTrials trials{};
    for (int t = 0; t < kWlrTrials; ++t) {
        const double h = TrialBandwidth(t);
        trials.change[t] = truth.offset + truth.bias * h * h;
        trials.variance[t] = truth.Variance(h);
    }
    trials.dimensions = 4;
    trials.count = 8;
    const WlrCurves found = FitCurves(trials);
    EXPECT_NEAR(found.offset, truth.offset, 1e-4);
    EXPECT_NEAR(found.bias, truth.bias, 1e-4);
    EXPECT_NEAR(found.floor, truth.floor, 1e-6);
    EXPECT_NEAR(found.spread, truth.spread, 1e-6);
    const auto error = [&](double h) {
        const double b = truth.bias * h * h;
        return b * b + truth.Variance(h);
    };
    const double best = truth.BestBandwidth();
    EXPECT_LT(error(best), error(0.99 * best));
    EXPECT_LT(error(best), error(1.01 * best));
    // No bias: as wide as can be; all bias: no wider than a pixel; noise that falls with the
    // kernel's width is a mistake of the trials.
    EXPECT_EQ((WlrCurves{0, 0, 0, 1, 3, 8}).BestBandwidth(), 1);
    EXPECT_EQ((WlrCurves{0, 1e6, 0, 1e-9, 3, 8}).BestBandwidth(), 0.01);
    EXPECT_EQ((WlrCurves{0, 1, 1, 0, 3, 8}).BestBandwidth(), 0.01);
    for (double& variance : trials.variance) {
        variance = 1 - variance;
    }
    EXPECT_NEAR(FitCurves(trials).spread, 0.03, 1e-6);
    EXPECT_EQ(FitCurves(trials).floor, 0);
}

// The variances say that there is noise, so that kernels are broad; the fit alone keeps the image.
TEST(Wlr, KeepsARampOnFeaturesFreeOfNoise) {
    const Truth truth{90, 50};
    Frame frame = MakeGaussianFrame(truth, 1);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        const auto x = static_cast<float>(i % 90), y = static_cast<float>(i / 90);
        for (std::size_t c = 0; c < 3; ++c) {
            frame.color[c][i] = 0.5f + 0.004f * x - 0.003f * y +
                                0.2f * frame.feature[kAlbedoR + c][i] -
                                0.01f * frame.feature[kDepth][i];
        }
    }
    for (Plane& variance : frame.feature_variance) {
        std::ranges::fill(variance, 0.0f);
    }
    const Result result = RunDenoiser(*MakeDenoiser("wlr"), frame, CancelToken{});
    double largest = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            largest = std::max<double>(largest, std::abs(result.color[c][i] - frame.color[c][i]));
        }
    }
    EXPECT_LT(largest, 1e-4);
    // Not the pixel alone.
    EXPECT_LT((*result.error)[25 * 90 + 20], 0.2f * frame.variance[0][0]);
}

TEST(Wlr, LowersNoiseAndKeepsEdges) {
    const Truth truth{120, 80};
    const int edge = 72;
    for (const int spp : {4, 8, 32}) {
        const Frame frame = FrameFromFilm(MakeFilm(truth, spp, 7));
        const Result result = RunDenoiser(*MakeDenoiser("wlr"), frame, CancelToken{});
        EXPECT_LT(MrSE(truth, result.color, 0, 120), 0.2 * MrSE(truth, frame.color, 0, 120)) << spp;
        EXPECT_LT(MrSE(truth, result.color, edge - 2, edge + 2),
                  0.3 * MrSE(truth, frame.color, edge - 2, edge + 2))
            << spp;
    }
}

TEST(Wlr, BitsDoNotDependOnThreadsOrInstructionSet) {
    const WlrInput input = MakeWlrInput(GentleFrame(150, 70, 2, 0.1f));
    const Plane bandwidth(input.plane[0].size(), 0.6f);
    const auto run = [&](const WlrKernels& kernels) {
        Plane best(bandwidth.size());
        ForEachWlrPixel(input, 5, kernels, {}, [&](std::size_t i, const WlrCurves& curves) {
            best[i] = static_cast<float>(curves.BestBandwidth());
        });
        return std::pair(best, FitWlr(input, kWlrRadius, bandwidth, kernels, {}));
    };
    SetThreadCount(1);
    const auto reference = run(kWlrBaselineKernels);
    const WlrKernelList usable = UsableWlrKernels();
    for (int k = 0; k < usable.size; ++k) {
        for (const int threads : {1, 5}) {
            SetThreadCount(threads);
            EXPECT_EQ(run(*usable.list[k]), reference)
                << usable.list[k]->name << ", " << threads << " threads";
        }
    }
    SetThreadCount(0);
}

TEST(Wlr, PlanSharesOutTheBudgetToWhereErrorIs) {
    const Truth truth{100, 60};
    // Twice the noise on the left.
    const Frame frame =
        FrameFromFilm(MakeFilm(truth, 8, 3, [&](int x, int y, int, PixelSample* sample) {
            if (x >= 50) {
                sample->radiance = 0.5f * sample->radiance + truth.Color(x, y) * 0.5f;
            }
        }));
    const auto denoiser = MakeDenoiser("wlr");
    const Plane counts = denoiser->PlanSamples(frame, 60000, {});
    ASSERT_EQ(counts.size(), frame.pixel_count());
    double total = 0, left = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        ASSERT_GE(counts[i], 0);
        total += counts[i];
        left += i % 100 < 50 ? counts[i] : 0;
    }
    EXPECT_NEAR(total, 60000, 6);
    EXPECT_GT(left, 0.6 * total);
    EXPECT_TRUE(denoiser->PlanSamples(FrameFromFilm(MakeFilm(Truth{0, 0}, 4, 1)), 10, {}).empty());
}

TEST(Wlr, StopsWhenCancelled) {
    const Frame frame = MakeRandomFrame(20, 20, 6);
    CancelToken cancel;
    cancel.Cancel();
    EXPECT_THROW((void)MakeDenoiser("wlr")->Reconstruct(frame, cancel), Error);
    EXPECT_THROW((void)MakeDenoiser("wlr")->PlanSamples(frame, 100, cancel), Error);
}

}  // namespace
}  // namespace relume::denoise
