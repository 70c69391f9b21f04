// The robust filter: its candidates and their derivatives, its estimates, and where it tends to.
#include <gtest/gtest.h>

#include <cmath>

#include "server/denoise/bilateral.h"
#include "server/denoise/bilateral_robust_bank.h"
#include "tests/unit/denoise/reference_bilateral.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

RobustBank WholeBank(const Frame& frame) {
    RobustBank bank(frame, BestKernels(), {});
    bank.Extend(frame.height, {});
    return bank;
}

TEST(RobustBilateral, EveryCandidateFollowsTheEquations) {
    const Frame frame = MakeRandomFrame(67, 11, 1);
    const RobustBank bank = WholeBank(frame);
    double between = 0;
    for (int k = 0; k < kRobustCandidates; ++k) {
        const double sigma = std::pow(2.0, 0.5 * (k % kCandidates));
        const ReferenceResult reference = ReferenceRobust(frame, sigma, k >= kCandidates);
        for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                // As in bilateral_test.cpp: exp is right to 4e-6, and its argument to some 1e-6.
                ASSERT_NEAR(bank[k].filtered[c][i], reference.color[c][i], 2e-5)
                    << "candidate " << k << ", pixel " << i;
                between += std::abs(bank[k].filtered[c][i] - bank[k % kCandidates].filtered[c][i]);
            }
        }
    }
    // The range factor did something.
    EXPECT_GT(between / (3 * 7 * static_cast<double>(frame.pixel_count())), 1e-3);
}

// dF/dy by moving one noisy pixel up and down, the variances kept.
TEST(RobustBilateral, OwnShareIsTheDerivative) {
    constexpr int kWidth = 40, kHeight = 34;
    const Frame frame = MakeRandomFrame(kWidth, kHeight, 2);
    const RobustBank bank = WholeBank(frame);
    constexpr float kStep = 5e-4f;
    double by_range = 0;
    for (const std::size_t i : {0u, 7u + 5 * kWidth, 20u + 17 * kWidth, 39u + 33 * kWidth}) {
        for (std::size_t c = 0; c < 3; ++c) {
            Frame up = frame, down = frame;
            up.color[c][i] += kStep;
            down.color[c][i] -= kStep;
            const double step = static_cast<double>(up.color[c][i]) - down.color[c][i];
            const RobustBank above = WholeBank(up), below = WholeBank(down);
            for (int k = 0; k < kRobustCandidates; ++k) {
                const double slope =
                    (static_cast<double>(above[k].filtered[c][i]) - below[k].filtered[c][i]) / step;
                // Floats round at 6e-8, 1e-4 of the step; and the step passes the distance of some
                // neighbours from which their factor falls.
                EXPECT_NEAR(bank[k].own[c][i], slope, 1.5e-3)
                    << "candidate " << k << ", pixel " << i;
                if (k >= kCandidates) {
                    // What is left of it when the weights are kept: 1 / their sum.
                    const double w = 1.0 / (kCandidates * 12);
                    by_range += w * std::abs(bank[k].own[c][i] - bank[k - kCandidates].own[c][i]);
                }
            }
        }
    }
    EXPECT_GT(by_range, 0.01);
}

struct Bias {
    double sum = 0, squares = 0;
    int runs = 0;

    void Add(double x) {
        sum += x;
        squares += x * x;
        ++runs;
    }
    double mean() const { return sum / runs; }
    double deviation() const { return std::sqrt((squares / runs - mean() * mean()) / (runs - 1)); }
};

// A shadow's edge that no feature shows, so that range factors are at work.
Frame ShadowFrame(const Truth& truth, unsigned seed, Plane (&light)[3]) {
    Frame frame = MakeGaussianFrame(truth, seed);
    for (std::size_t c = 0; c < 3; ++c) {
        light[c].resize(frame.pixel_count());
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            const int x = static_cast<int>(i) % truth.width, y = static_cast<int>(i) / truth.width;
            const float shadow = x + y > 40 ? 0.4f : 0.0f;
            light[c][i] = truth.Color(x, y)[static_cast<int>(c)] + shadow;
            frame.color[c][i] += shadow;
        }
    }
    return frame;
}

TEST(RobustBilateral, SureIsUnbiased) {
    const Truth truth{48, 40};
    Bias sure[kRobustCandidates], without[kRobustCandidates];
    for (unsigned run = 0; run < 40; ++run) {
        Plane light[3];
        const Frame frame = ShadowFrame(truth, 100 + run, light);
        const RobustBank bank = WholeBank(frame);
        const auto pixels = static_cast<double>(frame.pixel_count());
        for (int k = 0; k < kRobustCandidates; ++k) {
            double difference = 0, blind = 0;
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                for (std::size_t c = 0; c < 3; ++c) {
                    const double e = bank[k].filtered[c][i] - light[c][i];
                    const double r = bank[k].filtered[c][i] - frame.color[c][i];
                    const double v = frame.variance[c][i];
                    difference += r * r + v * (2 * bank[k].own[c][i] - 1) - e * e;
                    // With the weights' own dependence on the noise left out.
                    blind += r * r + v * (2 * bank[k % kCandidates].own[c][i] - 1) - e * e;
                }
            }
            sure[k].Add(difference / pixels);
            without[k].Add(blind / pixels);
        }
    }
    for (int k = 0; k < kRobustCandidates; ++k) {
        // Fourteen tests at once: 3.4 standard errors is 1 % for all.
        EXPECT_LT(std::abs(sure[k].mean()), 3.4 * sure[k].deviation()) << "candidate " << k;
        if (k >= kCandidates) {
            EXPECT_LT(without[k].mean(), -3.4 * without[k].deviation()) << "candidate " << k;
        }
    }
}

TEST(RobustBilateral, SureOfACandidateIsWeighedByTheWidest) {
    const Frame frame = MakeRandomFrame(40, 35, 3);
    const RobustBank bank = WholeBank(frame);
    for (const int k : {0, 6, 9, 13}) {
        for (std::size_t i = 0; i < frame.pixel_count(); i += 37) {
            double sum = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const double widest = bank[kCandidates - 1].filtered[c][i];
                const double r = bank[k].filtered[c][i] - frame.color[c][i];
                sum += (r * r + frame.variance[c][i] * (2 * bank[k].own[c][i] - 1)) /
                       (3 * (widest * widest + 0.01));
            }
            ASSERT_NEAR(bank[k].sure[i], sum, 1e-5 * std::max(1.0, std::abs(sum)));
        }
    }
}

// Of the image that is returned. That the choice and the share depend on the noise makes the
// estimate a little low.
TEST(RobustBilateral, EstimatesTheErrorOfWhatItReturns) {
    const Truth truth{96, 80};
    const auto denoiser = MakeRobustBilateral(BestKernels());
    double estimated = 0, smoothed = 0, real = 0, noisy = 0;
    for (unsigned run = 0; run < 10; ++run) {
        Plane light[3];
        const Frame frame = ShadowFrame(truth, 200 + run, light);
        const Result result = denoiser->Reconstruct(frame, {});
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            smoothed += 3 * (*result.error)[i];
            for (std::size_t c = 0; c < 3; ++c) {
                const double e = result.color[c][i] - light[c][i];
                const double r = result.color[c][i] - frame.color[c][i];
                estimated += r * r + frame.variance[c][i] * (2 * (*result.derivative)[c][i] - 1);
                real += e * e;
                noisy += frame.variance[c][i];
            }
        }
    }
    EXPECT_LT(real, 0.15 * noisy);
    EXPECT_LT(std::abs(estimated - real), 0.02 * noisy);
    EXPECT_NEAR(smoothed / estimated, 1, 0.1);  // a blur loses or doubles some at the borders
}

// No feature shows the random colours: as the variance falls, they are to be kept.
TEST(RobustBilateral, TendsToTheNoisyImage) {
    Frame frame = MakeRandomFrame(90, 70, 4);
    for (Plane& plane : frame.feature) {
        plane.assign(frame.pixel_count(), 0.5f);
    }
    for (int c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            frame.color[c][i] += 0.5f;
            frame.variance[c][i] = 1e-8f;
        }
    }
    const Result result = MakeRobustBilateral(BestKernels())->Reconstruct(frame, {});
    const Result corrected = MakeCorrectedBilateral(BestKernels())->Reconstruct(frame, {});
    double floor = 0;
    for (int c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            ASSERT_NEAR(result.color[c][i] / frame.color[c][i], 1, 1e-3) << i;
            floor = std::max<double>(floor, std::abs(corrected.color[c][i] - frame.color[c][i]));
        }
    }
    EXPECT_GT(floor, 0.1) << "a filter that nothing puts to the test";
}

// Frames are filtered some rows at a time.
TEST(RobustBilateral, RowsDroppedLeaveTheOthers) {
    const Frame frame = MakeRandomFrame(40, 170, 5);
    const RobustBank whole = WholeBank(frame);
    RobustBank bank(frame, BestKernels(), {});
    bank.Extend(64, {});
    bank.Drop(50);
    bank.Extend(170, {});
    bank.Drop(60);
    ASSERT_EQ(bank.begin(), 60);
    ASSERT_EQ(bank.end(), 170);
    for (int k = 0; k < kRobustCandidates; ++k) {
        const auto rest = [](const Plane& plane) {
            return Plane(plane.begin() + 60 * 40, plane.end());
        };
        EXPECT_EQ(bank[k].sure, rest(whole[k].sure));
        EXPECT_EQ(bank[k].filtered[1], rest(whole[k].filtered[1]));
        EXPECT_EQ(bank[k].own[2], rest(whole[k].own[2]));
    }
}

}  // namespace
}  // namespace relume::denoise
