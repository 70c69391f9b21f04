// Samplers that follow a filter's own plan: what they make of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/error.h"
#include "server/jobs/planner.h"

namespace relume::jobs {
namespace {

constexpr int kWidth = 32, kHeight = 16;
constexpr std::size_t kPixels = kWidth * kHeight;

std::uint64_t Sum(const std::vector<std::uint32_t>& counts) {
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

// All passes of a sampler, on a film that stays black.
struct Passes {
    std::vector<std::vector<std::uint32_t>> counts;
    std::string reason;
};

Passes RunSampler(const std::string& sampler, std::uint64_t budget, const Guide& guide) {
    const Film film({0, 0, kWidth, kHeight}, kWidth, kHeight);
    const auto planner = MakePlanner(sampler);
    std::vector<std::uint32_t> planned(kPixels, 0);
    Passes passes;
    while (passes.counts.size() < 100) {
        const Plan plan = planner->NextPass({film, budget - Sum(planned), planned, &guide});
        if (plan.counts.empty()) {
            passes.reason = plan.reason;
            break;
        }
        for (std::size_t i = 0; i < kPixels; ++i) {
            EXPECT_EQ(plan.counts[i] % 2, 0u);
            planned[i] += plan.counts[i];
        }
        passes.counts.push_back(plan.counts);
    }
    return passes;
}

// Everything to the left half.
std::vector<float> LeftHalf(const Film& film, double samples) {
    std::vector<float> counts(film.pixel_count(), 0.0f);
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (i % kWidth < kWidth / 2) {
            counts[i] = static_cast<float>(2 * samples / kPixels);
        }
    }
    return counts;
}

TEST(MethodPlanner, SpendsTheRestInEqualPartsWhereTheFilterSays) {
    const Passes passes = RunSampler("nlm:pilot=4,passes=4", 16 * kPixels, LeftHalf);
    ASSERT_EQ(passes.counts.size(), 5u);
    EXPECT_THAT(passes.counts[0], testing::Each(4u));
    EXPECT_EQ(passes.reason, kBudgetSpent);
    for (std::size_t pass = 1; pass < 5; ++pass) {
        EXPECT_EQ(Sum(passes.counts[pass]), 3 * kPixels);
        std::uint64_t left = 0;
        for (std::size_t i = 0; i < kPixels; ++i) {
            left += i % kWidth < kWidth / 2 ? passes.counts[pass][i] : 0;
        }
        // But for what is left over by rounding.
        EXPECT_GT(left, 2.8 * kPixels);
    }
}

TEST(MethodPlanner, APassHasAtMostThreeTimesWhatThereIs) {
    std::vector<double> asked;
    const Passes passes = RunSampler("sbf", 128 * kPixels, [&](const Film& film, double samples) {
        asked.push_back(samples / static_cast<double>(film.pixel_count()));
        return LeftHalf(film, samples);
    });
    EXPECT_THAT(asked, testing::ElementsAre(24, 96));
    EXPECT_EQ(passes.reason, kBudgetSpent);
}

TEST(MethodPlanner, AFilterThatAsksForNothingGetsAllPixelsAlike) {
    for (const float each : {0.0f, std::numeric_limits<float>::quiet_NaN()}) {
        const Passes passes = RunSampler(
            "gem:passes=1", 8 * kPixels,
            [&](const Film& film, double) { return std::vector<float>(film.pixel_count(), each); });
        ASSERT_EQ(passes.counts.size(), 2u);
        EXPECT_THAT(passes.counts[1], testing::Each(4u));
    }
    const Passes none = RunSampler("rd:passes=1", 8 * kPixels,
                                   [](const Film&, double) { return std::vector<float>(); });
    EXPECT_THAT(none.counts[1], testing::Each(4u));
}

TEST(MethodPlanner, NamesItsFilter) {
    for (const char* name : {"gem", "nlm", "sbf", "rd", "wlr"}) {
        EXPECT_STREQ(MakePlanner(name)->Method(), name);
    }
    EXPECT_EQ(MakePlanner("adaptive")->Method(), nullptr);
    EXPECT_THROW(MakePlanner("wlr:passes=0"), Error);
    EXPECT_THROW(MakePlanner("wlr:pilot=3"), Error);
}

}  // namespace
}  // namespace relume::jobs
