#include "server/jobs/budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace relume::jobs {
namespace {

using testing::HasSubstr;

constexpr std::uint64_t kPixels = 1000;

BudgetState State(std::uint64_t planned, std::uint64_t done) {
    BudgetState state;
    state.pixels = kPixels;
    state.planned = planned;
    state.done = done;
    return state;
}

TEST(Budget, TheLeastOfAllThatAreGivenHolds) {
    Budgets budgets;
    EXPECT_GT(NextAllowance(budgets, State(0, 0)).samples, 1u << 30);
    budgets.samples = 32 * kPixels;
    EXPECT_EQ(NextAllowance(budgets, State(0, 0)).samples, 32 * kPixels);
    EXPECT_EQ(NextAllowance(budgets, State(30 * kPixels, 0)).samples, 2 * kPixels);
    budgets.seconds = 10;  // measured by a pair a pixel first
    EXPECT_EQ(NextAllowance(budgets, State(0, 0)).samples, 2 * kPixels);
    const auto spent = NextAllowance(budgets, State(32 * kPixels, 0));
    ASSERT_TRUE(spent.stop);
    EXPECT_EQ(spent.stop->reason, StopReason::kSamples);
    EXPECT_EQ(spent.stop->words, "sample budget spent");
}

TEST(Budget, APixelsCapIsTheGivenOneElseWhatNothingElseBounds) {
    Budgets budgets;
    EXPECT_EQ(PixelCap(budgets), kDefaultMaxSpp);
    budgets.target = 0.01;
    EXPECT_EQ(PixelCap(budgets), kDefaultMaxSpp);
    EXPECT_THAT(CapStop(budgets).words, HasSubstr("16384, the most without --max-spp"));
    budgets.seconds = 5;
    EXPECT_EQ(PixelCap(budgets), kMaxPixelSamples);
    budgets.max_spp = 7;
    EXPECT_EQ(PixelCap(budgets), 7u);
    EXPECT_EQ(CapStop(budgets).words, "every pixel that wants more samples has 7, the most");
    EXPECT_EQ(CapStop(budgets).reason, StopReason::kMaxSpp);
}

struct TimeCase {
    double limit, seconds, finish, speed;  // speed in samples a second
    std::uint64_t planned, done;
    std::uint64_t low, high;  // of what is allowed; 0: it stops
    double plan = 0;          // seconds
};

TEST(Budget, TimeAllowsWhatFitsBeforeTheFinish) {
    for (const TimeCase& c : std::vector<TimeCase>{
             // Much fits: 60 % of it. The margin is 2 % of the limit.
             {10, 1, 1, 1000, 2000, 2000, 4660, 4700},
             // What is planned and not yet rendered comes first.
             {10, 1, 1, 1000, 5000, 2000, 2860, 2900},
             // The plan is made meanwhile, or takes longer.
             {10, 1, 1, 1000, 5000, 2000, 2860, 2900, 3},
             {10, 1, 1, 1000, 5000, 2000, 1660, 1700, 5},
             // Little fits: all of it.
             {10, 8.5, 1, 1000, 9000, 9000, 290, 310},
             // Too little fits.
             {10, 8.75, 1, 1000, 9000, 9000, 0, 0},
             {10, 20, 1, 1000, 9000, 9000, 0, 0},
             // The finish alone is longer than the limit.
             {10, 1, 20, 1000, 2000, 2000, 0, 0},
             // No speed is known yet: a pair a pixel.
             {10, 1, 1, 0, 2000, 0, 2000, 2000},
         }) {
        Budgets budgets;
        budgets.seconds = c.limit;
        BudgetState state = State(c.planned, c.done);
        state.seconds = c.seconds;
        state.finish_seconds = c.finish;
        state.plan_seconds = c.plan;
        state.samples_per_second = c.speed;
        const auto allowed = NextAllowance(budgets, state);
        EXPECT_GE(allowed.samples, c.low) << c.seconds;
        EXPECT_LE(allowed.samples, c.high) << c.seconds;
        EXPECT_EQ(allowed.stop.has_value(), c.high == 0) << c.seconds;
        if (allowed.stop) {
            EXPECT_EQ(allowed.stop->reason, StopReason::kTimeLimit);
        }
    }
}

TEST(Budget, ALimitThatWasTooShortIsSaidToBe) {
    Budgets budgets;
    budgets.seconds = 1;
    BudgetState state = State(2 * kPixels, 2 * kPixels);
    state.samples_per_second = 100;
    state.seconds = 20;
    EXPECT_THAT(NextAllowance(budgets, state).stop->words,
                HasSubstr("passed with 2 samples a pixel"));
    state.seconds = 0.95;
    EXPECT_EQ(NextAllowance(budgets, state).stop->words, "time limit reached");
}

TEST(Budget, TimePassesShrinkAndEndWithinTheLimit) {
    // A farm whose speed wavers by 20 % from pass to pass.
    for (const double speed : {3000.0, 50'000.0, 4e6}) {
        for (const double limit : {2.0, 20.0, 600.0}) {
            std::mt19937 random(7);
            Budgets budgets;
            budgets.seconds = limit;
            BudgetState state = State(0, 0);
            state.finish_seconds = 0.05 * limit;
            state.seconds = 0.02 * limit;
            int passes = 0;
            for (;; ++passes) {
                const auto allowed = NextAllowance(budgets, state);
                if (allowed.stop) {
                    break;
                }
                ASSERT_GT(allowed.samples, 0u);
                ASSERT_LT(passes, 60);
                state.samples_per_second =
                    speed * std::uniform_real_distribution<>(0.9, 1.1)(random);
                state.seconds += static_cast<double>(allowed.samples) / state.samples_per_second;
                state.planned += allowed.samples;
                state.done = state.planned;
            }
            const double end = state.seconds + state.finish_seconds;
            EXPECT_LE(end, limit) << speed;
            EXPECT_GE(end, 0.9 * limit) << speed;
        }
    }
}

// Error constant / n^p, told with some noise: where a job of this target ends.
struct TargetRun {
    double truth = 0;  // relative to the target
    int passes = 0;
    double spp = 0;
};
TargetRun RunToTarget(double constant, double p, double target, bool filtered, double noise,
                      std::uint32_t seed) {
    std::mt19937 random(seed);
    std::normal_distribution<> normal;
    Budgets budgets;
    budgets.target = target;
    BudgetState state = State(0, 0);
    state.filtered = filtered;
    std::vector<ErrorPoint> errors;
    TargetRun run;
    const auto spp = [&] {
        return static_cast<double>(state.planned) / static_cast<double>(kPixels);
    };
    state.planned = state.done = 8 * kPixels;
    for (run.passes = 1; run.passes < 100; ++run.passes) {
        run.truth = constant / std::pow(spp(), p) / target;
        errors.push_back({state.planned, run.truth * target * (1 + noise * normal(random))});
        state.errors = errors;
        const auto allowed = NextAllowance(budgets, state);
        if (allowed.stop) {
            EXPECT_EQ(allowed.stop->reason, StopReason::kTarget);
            break;
        }
        EXPECT_LE(allowed.samples, state.planned) << "at most a doubling";
        EXPECT_GT(allowed.samples, 0u);
        state.planned += allowed.samples;
        state.done = state.planned;
    }
    run.spp = spp();
    return run;
}

TEST(Budget, ATargetIsMetWithinALittle) {
    for (const double start : {1.3, 3.0, 10.0, 77.0, 500.0}) {  // error of the pilot over target
        for (std::uint32_t seed = 0; seed < 20; ++seed) {
            const TargetRun plain = RunToTarget(start * 8 * 0.01, 1, 0.01, false, 0.03, seed);
            EXPECT_GE(plain.truth, 0.75) << start;
            EXPECT_LE(plain.truth, 1.15) << start;
            EXPECT_LE(plain.passes, 14) << start;
            for (const double p : {0.4, 0.7, 1.0}) {
                const double constant = start * std::pow(8, p) * 0.01;
                const TargetRun run = RunToTarget(constant, p, 0.01, true, 0.03, seed);
                EXPECT_GE(run.truth, 0.7) << start << " " << p;
                EXPECT_LE(run.truth, 1.2) << start << " " << p;
                EXPECT_LE(run.passes, 35) << start << " " << p;
            }
            // Adaptive sampling falls faster than 1/n as long as it catches up.
            const TargetRun steep =
                RunToTarget(start * std::pow(8, 1.4) * 0.01, 1.4, 0.01, false, 0.03, seed);
            EXPECT_GE(steep.truth, 0.7) << start;
            EXPECT_LE(steep.truth, 1.2) << start;
        }
    }
}

TEST(Budget, ATargetIsMetSaysWithWhat) {
    Budgets budgets;
    budgets.target = 0.01;
    BudgetState state = State(8000, 8000);
    const std::vector<ErrorPoint> errors{{8000, 0.0098}};
    state.errors = errors;
    const auto allowed = NextAllowance(budgets, state);
    ASSERT_TRUE(allowed.stop);
    EXPECT_EQ(allowed.stop->words, "target reached: estimated RelMSE 0.0098 of 0.01");
}

TEST(Budget, AnErrorThatIsNoNumberIsNeverReached) {
    Budgets budgets;
    budgets.target = 0.01;
    BudgetState state = State(8000, 8000);
    for (const double error : {std::nan(""), HUGE_VAL}) {
        const std::vector<ErrorPoint> errors{{8000, error}};
        state.errors = errors;
        EXPECT_EQ(NextAllowance(budgets, state).samples, 8000u);
    }
}

TEST(ErrorCurve, PowersAndRootsAgreeWithTheLibrary) {
    for (const int sixteenths : {5, 8, 11, 16, 24}) {
        const Exponent p{sixteenths};
        for (const double x : {1e-6, 0.3, 1.0, 2.0, 77.7, 1e9}) {
            EXPECT_NEAR(Power(x, p) / std::pow(x, p.value()), 1, 1e-12);
        }
        for (const double x : {1.0, 1.5, 8.0}) {
            EXPECT_NEAR(Root(x, p, 1e9) / std::pow(x, 1 / p.value()), 1, 1e-9);
            EXPECT_EQ(Root(x, p, 1.0), 1);
        }
    }
}

TEST(ErrorCurve, TheExponentIsFoundAgain) {
    for (const int sixteenths : {6, 9, 12, 16}) {
        std::vector<ErrorPoint> errors;
        for (const std::uint64_t n : {8000u, 16'000u, 24'000u, 48'000u}) {
            errors.push_back(
                {n, 3 / std::pow(static_cast<double>(n), Exponent{sixteenths}.value())});
        }
        EXPECT_EQ(FitExponent(errors, true).sixteenths, sixteenths);
        EXPECT_EQ(FitExponent(errors, false).sixteenths, 16);
        EXPECT_NEAR(ExpectedError(errors, {sixteenths}, 8000), errors[0].error, 1e-12);
    }
    // Out of its range, and where there is nothing to fit.
    EXPECT_EQ(FitExponent(std::vector<ErrorPoint>{{8, 1}, {16, 1}}, true).sixteenths, 5);
    EXPECT_EQ(FitExponent(std::vector<ErrorPoint>{{8, 1}, {16, 0.1}}, true).sixteenths, 16);
    for (const auto& errors : std::vector<std::vector<ErrorPoint>>{
             {}, {{8, 1}}, {{8, 1}, {16, 0}}, {{8, std::nan("")}, {16, 1}}, {{8, 1}, {8, 2}}}) {
        EXPECT_EQ(FitExponent(errors, true).sixteenths, 11);
    }
}

}  // namespace
}  // namespace relume::jobs
