#include "server/jobs/forecast.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace relume::jobs {
namespace {

TimePoint At(double seconds) { return TimePoint{} + FromSeconds(seconds); }

TEST(SpeedMeter, TellsNothingBeforeTwoAnswers) {
    SpeedMeter meter;
    EXPECT_EQ(meter.Get().mean, 0);
    meter.Add(At(5), 1000);  // loading the scene took 5 s
    EXPECT_EQ(meter.Get().mean, 0);
    meter.Add(At(6), 1000);
    EXPECT_DOUBLE_EQ(meter.Get().mean, 1000);
}

TEST(SpeedMeter, MeasuresTheNewerHalf) {
    SpeedMeter meter;
    double t = 0;
    for (int i = 0; i < 2000; ++i) {
        meter.Add(At(t += 0.01), 10);  // 1000 a second
    }
    for (int i = 0; i < 4000; ++i) {
        meter.Add(At(t += 0.01), 40);  // workers came
    }
    const auto speed = meter.Get();
    EXPECT_NEAR(speed.mean, 4000, 40);
    EXPECT_NEAR(speed.low, 4000, 400);
    EXPECT_NEAR(speed.high, 4000, 400);
}

TEST(SpeedMeter, TellsHowFarThePartsAreApart) {
    SpeedMeter meter;
    double t = 0;
    for (int i = 0; i < 1600; ++i) {
        meter.Add(At(t += (i / 200 % 2 == 0 ? 0.01 : 0.02)), 10);
    }
    const auto speed = meter.Get();
    EXPECT_NEAR(speed.low, 500, 50);
    EXPECT_NEAR(speed.high, 1000, 100);
    EXPECT_GT(speed.mean, speed.low);
    EXPECT_LT(speed.mean, speed.high);
}

TEST(SpeedMeter, AnswersAllAtOnceAreNoReasonToDivideByNothing) {
    SpeedMeter meter;
    meter.Add(At(1), 10);
    meter.Add(At(2), 10);
    meter.Add(At(2), 1000);
    EXPECT_DOUBLE_EQ(meter.Get().mean, 1010);
}

ForecastInput Input(const std::vector<ErrorPoint>& errors) {
    ForecastInput input;
    input.pixels = 1000;
    input.done = 8000;
    input.seconds = 10;
    input.speed = {1000, 800, 1250};
    input.finish_seconds = 2;
    input.errors = errors;
    return input;
}

TEST(Forecast, DoublesUpToTheBudget) {
    const std::vector<ErrorPoint> errors{{8000, 0.08}};
    ForecastInput input = Input(errors);
    input.budgets.samples = 40'000;
    const auto curve = Forecast(input);
    ASSERT_EQ(curve.size(), 4u);
    EXPECT_EQ(curve[0].samples, 8000u);
    EXPECT_DOUBLE_EQ(curve[0].relmse, 0.08);
    EXPECT_DOUBLE_EQ(curve[0].seconds, 12);
    EXPECT_EQ(curve[2].samples, 32'000u);
    EXPECT_NEAR(curve[2].relmse, 0.02, 1e-12);
    EXPECT_DOUBLE_EQ(curve[2].seconds, 36);
    EXPECT_EQ(curve[3].samples, 40'000u);
}

TEST(Forecast, EndsWhereTargetOrTimeDoOrAt64Times) {
    const std::vector<ErrorPoint> errors{{8000, 0.08}};
    ForecastInput input = Input(errors);
    EXPECT_EQ(Forecast(input).back().samples, 64 * 8000u);
    input.budgets.target = 0.01;
    EXPECT_NEAR(static_cast<double>(Forecast(input).back().samples), 64'000, 2);
    EXPECT_NEAR(Forecast(input).back().relmse, 0.01, 1e-6);
    input.budgets.seconds = 20;  // 8 of them to render
    EXPECT_NEAR(static_cast<double>(Forecast(input).back().samples), 16'000, 1);
    EXPECT_NEAR(Forecast(input).back().seconds, 20, 1e-3);
    input.speed = {};
    EXPECT_TRUE(Forecast(input).empty());
    EXPECT_TRUE(Forecast(Input({})).empty());
}

TEST(Eta, ComesFromSpeedAndBudgetWithAnInterval) {
    const std::vector<ErrorPoint> errors{{4000, 0.16}, {8000, 0.08}};
    ForecastInput input = Input(errors);
    EXPECT_FALSE(EstimateEta(input));
    input.budgets.samples = 40'000;
    const Eta eta = *EstimateEta(input);
    EXPECT_DOUBLE_EQ(eta.seconds, 34);
    EXPECT_DOUBLE_EQ(eta.low, 32 / 1.25 + 2);
    EXPECT_DOUBLE_EQ(eta.high, 32 / 0.8 + 2);
}

TEST(SamplesLeft, IsTheLeastThatABudgetTells) {
    const std::vector<ErrorPoint> errors{{8000, 0.08}};
    ForecastInput input = Input(errors);
    EXPECT_FALSE(SamplesLeft(input));
    input.budgets.samples = 40'000;
    EXPECT_DOUBLE_EQ(*SamplesLeft(input), 32'000);
    input.budgets.seconds = 20;  // 8 of them to render
    EXPECT_DOUBLE_EQ(*SamplesLeft(input), 8000);
    input.budgets.target = 0.04;
    input.budgets.seconds = 1000;
    EXPECT_NEAR(*SamplesLeft(input), 8000, 1);
    input.done = 50'000;
    EXPECT_DOUBLE_EQ(*SamplesLeft(input), 0);
    input = Input({});
    input.budgets.target = 0.04;
    EXPECT_FALSE(SamplesLeft(input)) << "nothing is known of the error";
    input.speed = {};
    input.budgets.seconds = 20;
    EXPECT_FALSE(SamplesLeft(input)) << "nothing is known of the speed";
}

TEST(Eta, OfATargetWidensWithTheErrorsScatter) {
    const std::vector<ErrorPoint> smooth{{2000, 0.32}, {4000, 0.16}, {8000, 0.08}};
    const std::vector<ErrorPoint> rough{{2000, 0.32}, {4000, 0.20}, {8000, 0.08}};
    ForecastInput input = Input(smooth);
    input.budgets.target = 0.01;
    const Eta a = *EstimateEta(input);
    input.errors = rough;
    const Eta b = *EstimateEta(input);
    EXPECT_NEAR(a.seconds, 58, 0.1);
    EXPECT_NEAR(b.seconds, 58, 0.1);
    EXPECT_LT(a.low, a.seconds);
    EXPECT_GT(a.high, a.seconds);
    EXPECT_GT(b.high - b.low, a.high - a.low);
}

TEST(Eta, OfATimeLimitIsWhatIsLeftOfIt) {
    ForecastInput input = Input({});
    input.budgets.seconds = 30;
    EXPECT_DOUBLE_EQ(EstimateEta(input)->seconds, 20);
    EXPECT_DOUBLE_EQ(EstimateEta(input)->high, 20);
    input.budgets.samples = 9000;
    EXPECT_DOUBLE_EQ(EstimateEta(input)->seconds, 3);
    input.seconds = 40;
    EXPECT_DOUBLE_EQ(EstimateEta(input)->seconds, 0);
}

}  // namespace
}  // namespace relume::jobs
