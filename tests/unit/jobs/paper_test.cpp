#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "core/film/moments.h"
#include "server/jobs/paper_rule.h"
#include "server/jobs/planner.h"

namespace relume::jobs {
namespace {

using testing::Each;
using testing::ElementsAre;

constexpr std::array<std::uint32_t, 4> kAlpha{1, 2, 4, 8};

PixelEstimate Estimate(float mean, float variance, float n) {
    PixelEstimate e;
    e.n = n;
    for (int c = 0; c < 3; ++c) {
        e.mean[c] = mean;
        e.variance[c] = variance;
    }
    return e;
}

TEST(PaperRule, SppFactorsAreThoseOfTheTable) {
    // methods 3.1, "k for the spp pairs met", to its two decimals.
    EXPECT_NEAR(SppFactor(2, 4), 1.67, 0.005);
    EXPECT_NEAR(SppFactor(4, 5), 4.56, 0.005);
    EXPECT_NEAR(SppFactor(4, 6), 2.60, 0.005);
    EXPECT_NEAR(SppFactor(8, 9), 8.53, 0.005);
    EXPECT_NEAR(SppFactor(16, 17), 16.5, 0.05);
    EXPECT_NEAR(SppFactor(64, 72), 8.53, 0.005);
}

TEST(PaperRule, GainsAreTheEquations) {
    const PixelEstimate c = Estimate(0.5f, 0.03f, 4), f = Estimate(0.7f, 0.02f, 8);
    const double k = 80.0 / 48.0;
    EXPECT_NEAR(PrintedGain(c, f), k + 0.01, 1e-6);
    EXPECT_NEAR(CorrectedGain(c, f), (k * 0.04 + 0.01) / (0.49 + 1e-3), 1e-6);
    // Negative only where the variance rose by more than the value moved.
    EXPECT_LT(CorrectedGain(Estimate(0.5f, 0.0f, 4), Estimate(0.5f, 0.1f, 8)), 0);
    EXPECT_EQ(CorrectedGain(Estimate(0, 0, 4), Estimate(0, 0, 8)), 0);
}

TEST(PaperRule, IncrementsAreEquationSix) {
    const double d[] = {-1, 0, 1e-9, 5e-3, 6e-3, 1e-2, 1.5e-2, 2e-2, 3e-2, 5e-2, 6e-2, 100};
    const std::uint32_t printed[] = {0, 0, 1, 1, 2, 2, 4, 4, 8, 8, 8, 8};
    const std::uint32_t corrected[] = {0, 0, 0, 0, 1, 1, 2, 2, 4, 4, 8, 8};
    for (std::size_t i = 0; i < std::size(d); ++i) {
        EXPECT_EQ(PrintedIncrement(d[i], kAlpha), printed[i]) << d[i];
        EXPECT_EQ(CorrectedIncrement(d[i], kAlpha), corrected[i]) << d[i];
    }
}

// Film of `width` x 1 pixels whose next samples are given by pixel.
void AddSamples(const std::vector<std::vector<float>>& samples, Film* film) {
    for (std::size_t x = 0; x < samples.size(); ++x) {
        if (samples[x].empty()) {
            continue;
        }
        PixelMoments moments;
        std::uint32_t index = film->NextIndex(x);
        for (const float value : samples[x]) {
            PixelSample sample;
            sample.radiance = {value, value, value};
            moments.Add(index++, sample);
        }
        TileResult result;
        const int column = static_cast<int>(x);
        result.rect = {column, 0, column + 1, 1};
        result.pixels = {0};
        result.planes.resize(kFilmChannelCount);
        moments.Store(result.planes.data(), 1);
        film->Merge(result);
    }
}

TEST(Paper, PrintedGivesEveryPixelTheMost) {
    // methods 3.1: both literal readings of (5) are trivial.
    Film film({0, 0, 3, 1}, 3, 1);
    const auto planner = MakePlanner("paper:mode=printed");
    EXPECT_THAT(planner->NextPass({film, 1000}).counts, Each(4u));
    AddSamples({{1, 1, 1, 1}, {0, 0, 0, 0}, {0.1f, 0.5f, 0.3f, 0.4f}}, &film);
    EXPECT_THAT(planner->NextPass({film, 1000}).counts, Each(8u));
}

TEST(Paper, PrintedStopsAPixelThatAFireflyHit) {
    Film film({0, 0, 2, 1}, 2, 1);
    const auto planner = MakePlanner("paper:mode=printed");
    planner->NextPass({film, 1000});
    AddSamples({{1, 1, 1, 1}, {1, 1, 1, 1}}, &film);
    planner->NextPass({film, 1000});
    AddSamples({{1, 1, 1, 1, 1, 1, 1, 1}, {1, 1, 1, 90, 1, 1, 1, 1}}, &film);
    EXPECT_THAT(planner->NextPass({film, 1000}).counts, ElementsAre(8, 0));
    // It keeps its D: stopped for good.
    AddSamples({{1, 1, 1, 1, 1, 1, 1, 1}, {}}, &film);
    EXPECT_THAT(planner->NextPass({film, 1000}).counts, ElementsAre(8, 0));
}

TEST(Paper, CorrectedFirstPassComparesTheEvenHalfWithAll) {
    // One pixel: halves {a, b}, all samples of a half equal. s^2/n within the halves is 0, so that
    // Var vanishes and D = k (c-f)^2/(f^2+1e-3) with c = a, f = (a+b)/2, k = 5/3.
    const auto increment = [](float a, float b) {
        Film film({0, 0, 1, 1}, 1, 1);
        const auto planner = MakePlanner("paper:mode=corrected");
        planner->NextPass({film, 1000});
        AddSamples({{a, b, a, b}}, &film);
        const Plan plan = planner->NextPass({film, 1000});
        return plan.counts.empty() ? 0u : plan.counts[0];
    };
    // f = 1: D = 5/3 e^2/1.001 for a = 1-e, b = 1+e.
    EXPECT_EQ(increment(0.95f, 1.05f), 0u);  // D = .0042
    EXPECT_EQ(increment(0.93f, 1.07f), 1u);  // .0082
    EXPECT_EQ(increment(0.90f, 1.10f), 2u);  // .0167
    EXPECT_EQ(increment(0.85f, 1.15f), 4u);  // .0375
    EXPECT_EQ(increment(0.80f, 1.20f), 8u);  // .0666
}

TEST(Paper, CorrectedStopsWhereNothingWasSeenAndSaysWhenAllHave) {
    // The documented failure: a pixel whose samples all missed the light stops for ever.
    Film film({0, 0, 2, 1}, 2, 1);
    const auto planner = MakePlanner("paper");
    planner->NextPass({film, 1000});
    AddSamples({{0, 0, 0, 0}, {0.1f, 1, 0.2f, 2}}, &film);
    EXPECT_THAT(planner->NextPass({film, 1000}).counts, ElementsAre(0, 8));
    AddSamples({{}, {0.8f, 0.9f, 0.7f, 0.8f, 0.85f, 0.84f, 0.83f, 0.86f}}, &film);
    // Var fell and the mean hardly moved from .825 to .822, but one difference of variances is
    // left: go on until that is small, too.
    std::string reason;
    for (int pass = 0; pass < 50 && reason.empty(); ++pass) {
        const Plan plan = planner->NextPass({film, 100'000});
        if (plan.counts.empty()) {
            reason = plan.reason;
            break;
        }
        EXPECT_EQ(plan.counts[0], 0u);
        AddSamples({{}, std::vector<float>(plan.counts[1], 0.82f)}, &film);
    }
    EXPECT_EQ(reason, "selector negative everywhere");
}

TEST(Paper, ScalesTheLastPassToTheBudget) {
    Film film({0, 0, 4, 1}, 4, 1);
    const auto planner = MakePlanner("paper");
    planner->NextPass({film, 1000});
    AddSamples({{0.8f, 1.2f, 0.8f, 1.2f},
                {0.5f, 1.5f, 0.5f, 1.5f},
                {0.8f, 1.2f, 0.8f, 1.2f},
                {1, 1, 1, 1}},
               &film);
    // The first three want 8 each.
    EXPECT_THAT(planner->NextPass({film, 11}).counts, ElementsAre(4, 3, 4, 0));
}

TEST(Paper, PrintedTakesTheVarianceOverAllSamples) {
    // c: the even samples 1, 3, Var = 1. f: 1, 4, 3, 4 with s^2 = 2, Var = .5: D = 5/3 + .5.
    const auto d = [](float odd) {
        Film film({0, 0, 1, 1}, 1, 1);
        const auto planner = MakePlanner("paper:mode=printed");
        planner->NextPass({film, 1000});
        AddSamples({{1, odd, 3, odd}}, &film);
        return planner->NextPass({film, 1000}).counts;
    };
    EXPECT_THAT(d(4), ElementsAre(8));
    // Odd samples far away: within the halves s^2 is what it was, over all of them Var[f] - Var[c]
    // exceeds k, and the pixel stops.
    EXPECT_THAT(d(9), testing::IsEmpty());
}

TEST(Paper, APixelWithoutAFiniteSampleStops) {
    Film film({0, 0, 2, 1}, 2, 1);
    const auto planner = MakePlanner("paper");
    planner->NextPass({film, 1000});
    const float nan = std::numeric_limits<float>::quiet_NaN();
    AddSamples({{nan, nan, nan, nan}, {0.5f, 1.5f, 0.5f, 1.5f}}, &film);
    EXPECT_THAT(planner->NextPass({film, 1000}).counts, ElementsAre(0, 8));
}

TEST(Paper, SecondAlphaSetIsTaken) {
    Film film({0, 0, 1, 1}, 1, 1);
    const auto planner = MakePlanner("paper:alpha=1-4-16-32");
    planner->NextPass({film, 1000});
    AddSamples({{0.5f, 1.5f, 0.5f, 1.5f}}, &film);
    EXPECT_THAT(planner->NextPass({film, 1000}).counts, ElementsAre(32));
}

}  // namespace
}  // namespace relume::jobs
