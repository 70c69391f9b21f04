// Non-local means on two halves: what is its own beside what every filter owes (filters_test.cpp).
#include "server/denoise/nlm.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/unit/denoise/authors_rows.h"
#include "tests/unit/denoise/reference_nlm.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

double SumOf(const Plane& plane) { return std::accumulate(plane.begin(), plane.end(), 0.0); }

TEST(Nlm, FiltersEachHalfByWeightsFromTheOther) {
    Frame frame = MakeGaussianFrame({70, 40}, 1);
    // An odd count: 5 samples in half a, 4 in half b.
    std::ranges::fill(frame.count, 9.0f);
    const Result result = MakeNlm(BestNlmKernels())->Reconstruct(frame, {});
    const NlmOptions options{.symmetric = true, .weight_patch = 3, .least_weight = 0.05f};
    const NlmGuide guide[2] = {{70, 40, frame.half[0], frame.variance, 9.0f / 5},
                               {70, 40, frame.half[1], frame.variance, 9.0f / 4}};
    const ReferenceNlm by_a(guide[0], options), by_b(guide[1], options);
    // A weight near the floor may fall on either side of it.
    constexpr double kTolerance = 2e-4;
    for (const auto& [x, y] : {std::pair{2, 3}, {42, 20}, {69, 39}}) {
        const auto i = static_cast<std::size_t>(y * 70 + x);
        double error = 0;
        for (int c = 0; c < 3; ++c) {
            const double a = by_b.Filter(frame.half[0][c], 10, x, y);
            const double b = by_a.Filter(frame.half[1][c], 10, x, y);
            EXPECT_NEAR(result.color[c][i], (5 * a + 4 * b) / 9, kTolerance);
            error += 20.0 / 81 * (a - b) * (a - b) / 3;
        }
        EXPECT_NEAR((*result.error)[i], error, kTolerance * std::sqrt(error) + 1e-7);
    }
    EXPECT_EQ(result.notes.at("weights"), "from the other half");
}

TEST(Nlm, SameBitsForAnyInstructionSetAndThreadCount) {
    ExpectSameBits(MakeGaussianFrame({150, 70}, 2),
                   [](const NlmKernels& kernels) { return MakeNlm(kernels); });
}

// One colour, Gaussian noise: all error is variance. Weights differ from 1 only where the noise
// looks like something.
TEST(Nlm, EstimatesItsVariance) {
    const Truth truth{128, 96};
    for (const bool halves : {true, false}) {
        Frame frame = MakeGaussianFrame(truth, 3);
        for (int c = 0; c < 3; ++c) {
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                const Rgb color = truth.Color(static_cast<int>(i) % 128, static_cast<int>(i) / 128);
                for (Plane* plane : {&frame.half[0][c], &frame.half[1][c], &frame.color[c]}) {
                    (*plane)[i] += 1 - color[c];
                }
            }
        }
        if (!halves) {
            for (auto& half : frame.half) {
                for (Plane& plane : half) {
                    plane.clear();
                }
            }
        }
        const Result result = MakeNlm(BestNlmKernels())->Reconstruct(frame, {});
        double error = 0;
        for (const Plane& plane : result.color) {
            for (const float value : plane) {
                error += (value - 1) * (value - 1) / 3;
            }
        }
        // 128 x 96 pixels in windows of 21 x 21: 28 independent ones, in three colours, whose
        // squared errors differ by 1.4 of their mean each: 15 %. Twice that; of the weights that
        // the image itself gives, which follow its noise, three times.
        EXPECT_NEAR(SumOf(*result.error) / error, 1, halves ? 0.3 : 0.45);
        EXPECT_LT(error / static_cast<double>(frame.pixel_count()), 0.01 * 0.02);
    }
}

TEST(Nlm, WithoutHalvesTheWeightsAreItsOwn) {
    const Truth truth{120, 80};
    Frame frame = MakeGaussianFrame(truth, 4);
    for (auto& half : frame.half) {
        for (Plane& plane : half) {
            plane.clear();
        }
    }
    const auto nlm = MakeNlm(BestNlmKernels());
    const Result result = nlm->Reconstruct(frame, {});
    EXPECT_EQ(result.notes.at("weights"), "from the image itself");
    EXPECT_LT(MrSE(truth, result.color, 0, 120), 0.3 * MrSE(truth, frame.color, 0, 120));
    EXPECT_TRUE(nlm->PlanSamples(frame, 100, {}).empty());
}

// The right half of the image is ten times as noisy.
TEST(Nlm, PlansSamplesWhereTheFilteredHalvesDiffer) {
    const Truth truth{120, 80};
    Frame frame = MakeGaussianFrame(truth, 5);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        const int x = static_cast<int>(i) % 120, y = static_cast<int>(i) / 120;
        for (int c = 0; c < 3; ++c) {
            const float scale = x < 60 ? 0.3f : 1;
            for (Plane* plane : {&frame.half[0][c], &frame.half[1][c], &frame.color[c]}) {
                const float color = truth.Color(x, y)[c];
                (*plane)[i] = color + scale * ((*plane)[i] - color);
            }
            frame.variance[c][i] *= scale * scale;
        }
    }
    const Plane counts = MakeNlm(BestNlmKernels())->PlanSamples(frame, 40000, {});
    ASSERT_EQ(counts.size(), frame.pixel_count());
    EXPECT_NEAR(SumOf(counts), 40000, 4);
    double left = 0, right = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        ASSERT_GE(counts[i], 0);
        ASSERT_LE(counts[i], 8 * 40000.0 / 9600 * 1.0001);
        (i % 120 < 50    ? left
         : i % 120 >= 70 ? right
                         : right) += i % 120 < 70 && i % 120 >= 50 ? 0 : counts[i];
    }
    EXPECT_GT(right, 4 * left);
}

TEST_F(AuthorsRows, NlmComesNear) {
    const Image reference = Row("reference.exr"), theirs = Row("nlm.exr"), ours = Filter("nlm");
    const double row = MrSEOf(reference, theirs);
    EXPECT_LT(MrSEOf(reference, ours), 1.1 * row);
    EXPECT_LT(MrSEOf(theirs, ours), 0.15 * row);
}

}  // namespace
}  // namespace relume::denoise
