// Collaborative regression against its definition, what it must keep, and the same bits however
// computed.
#include "server/denoise/regression.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "tests/unit/denoise/reference_regression.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

// Weights neither all 0 nor all 1.
constexpr NlmOptions kSomeWeights = {.k = 1, .patch = 1};

RegressionInput InputOf(const Frame& frame, std::size_t features) {
    RegressionInput input;
    input.guide = NlmGuide(frame.width, frame.height, frame.color, frame.variance);
    input.weights = kSomeWeights;
    for (std::size_t f = 0; f < features; ++f) {
        input.features.push_back(&frame.feature[f]);
    }
    input.color = {&frame.half[0][0], &frame.half[0][1], &frame.half[0][2]};
    return input;
}

TEST(Regression, FollowsTheDefinition) {
    // More than one tile in both directions.
    const Frame frame = MakeRandomFrame(70, 37, 1);
    for (const std::size_t features : {0, 1, 2, 3, 4, 5, 6, 7, 8}) {
        const RegressionInput input = InputOf(frame, features);
        const auto result = RegressFirstOrder(input, 1, {});
        const auto reference = ReferenceRegression(input, 1e-4);
        double spread = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                // Sums of floats, through a matrix whose condition is some tens.
                ASSERT_NEAR(result[0][c][i], reference[c][i], 3e-5) << features << ", " << i;
                spread = std::max(spread, std::abs(result[0][c][i] - 0.5));
            }
        }
        EXPECT_GT(spread, 0.05);
    }
}

TEST(Regression, FurtherResultsHaveHalfTheK) {
    const Frame frame = MakeRandomFrame(50, 40, 2);
    RegressionInput input = InputOf(frame, 3);
    const auto results = RegressFirstOrder(input, 3, {});
    for (const std::size_t r : {1, 2}) {
        input.weights.k *= 0.5f;
        const auto alone = RegressFirstOrder(input, 1, {});
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            // exp is right to 4e-6, its sixteenth power to 6e-5.
            ASSERT_NEAR(results[r][0][i], alone[0][0][i], 2e-4);
        }
    }
}

// A ramp, a random feature that is free of noise, and constants: all that a linear function can say
// is kept, at the border, too, whatever the weights.
TEST(Regression, KeepsWhatIsLinearInXYAndFeatures) {
    constexpr int kWidth = 80, kHeight = 50;
    Frame frame = MakeRandomFrame(kWidth, kHeight, 3);
    RegressionInput input = InputOf(frame, 2);
    Plane color[3];
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const auto i = static_cast<std::size_t>(y * kWidth + x);
            color[0].push_back(0.01f * static_cast<float>(x) - 0.02f * static_cast<float>(y));
            color[1].push_back(0.5f * frame.feature[0][i] - 0.3f * frame.feature[1][i] +
                               0.002f * static_cast<float>(x));
            color[2].push_back(0.7f);
        }
    }
    input.color = {&color[0], &color[1], &color[2]};
    const auto results = RegressFirstOrder(input, 2, {});
    for (const auto& result : results) {
        for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                ASSERT_NEAR(result[c][i], color[c][i], 1e-4) << c << ", " << i;
            }
        }
    }
}

// Columns that say the same twice, or nothing, leave what the others say.
TEST(Regression, TakesDependentAndConstantColumns) {
    constexpr int kWidth = 40, kHeight = 30;
    const Frame frame = MakeRandomFrame(kWidth, kHeight, 4);
    Plane twice(frame.pixel_count()), ramp(frame.pixel_count()),
        constant(frame.pixel_count(), 0.3f), color(frame.pixel_count());
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        twice[i] = 0.5f - frame.feature[0][i];
        ramp[i] = 0.001f * static_cast<float>(i % kWidth);
        color[i] = 2 * frame.feature[0][i] + 30 * ramp[i];
    }
    RegressionInput input = InputOf(frame, 1);
    input.features.insert(input.features.end(), {&twice, &constant, &ramp, &constant});
    input.color = {&color, &constant, &twice};
    const auto result = RegressFirstOrder(input, 1, {});
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        ASSERT_NEAR(result[0][0][i], color[i], 3e-4);
        ASSERT_NEAR(result[0][1][i], constant[i], 1e-6);
        ASSERT_NEAR(result[0][2][i], twice[i], 1e-4);
    }
}

TEST(Regression, BitsDoNotDependOnThreadsOrInstructionSet) {
    const Frame frame = MakeRandomFrame(150, 70, 5);
    for (const std::size_t features : {3, 8}) {
        const RegressionInput input = InputOf(frame, features);
        SetThreadCount(1);
        const auto reference = RegressFirstOrder(input, 2, {}, kRegressionBaselineKernels);
        const RegressionKernelList usable = UsableRegressionKernels();
        for (int k = 0; k < usable.size; ++k) {
            for (const int threads : {1, 5}) {
                SetThreadCount(threads);
                EXPECT_EQ(RegressFirstOrder(input, 2, {}, *usable.list[k]), reference)
                    << usable.list[k]->name << ", " << threads << " threads";
            }
        }
    }
    SetThreadCount(0);
}

TEST(Regression, StopsWhenCancelled) {
    const Frame frame = MakeRandomFrame(20, 20, 6);
    CancelToken cancel;
    cancel.Cancel();
    EXPECT_THROW((void)RegressFirstOrder(InputOf(frame, 2), 1, cancel), Error);
}

}  // namespace
}  // namespace relume::denoise
