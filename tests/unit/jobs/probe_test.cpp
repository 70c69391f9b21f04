#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "core/base/error.h"
#include "server/jobs/planner.h"

namespace relume::jobs {
namespace {

std::vector<std::uint32_t> FirstPass(const std::string& text, int width, int height,
                                     std::uint64_t budget = 1'000'000'000) {
    const Film film({0, 0, width, height}, width, height);
    return MakePlanner(text)->NextPass({film, budget}).counts;
}

std::size_t Chosen(const std::vector<std::uint32_t>& counts) {
    return static_cast<std::size_t>(
        std::count_if(counts.begin(), counts.end(), [](std::uint32_t c) { return c != 0; }));
}

TEST(Probe, SamplesAsManyPixelsAsAskedForAndNoOthers) {
    const auto counts = FirstPass("probe:pixels=100,spp=64", 80, 60);
    EXPECT_EQ(Chosen(counts), 100u);
    EXPECT_THAT(counts, testing::Each(testing::AnyOf(0u, 64u)));
    EXPECT_THAT(FirstPass("probe:pixels=100,spp=64", 10, 10), testing::Each(64u));
    EXPECT_THAT(FirstPass("probe:pixels=101,spp=64", 10, 10), testing::Each(64u));
    EXPECT_EQ(Chosen(FirstPass("probe:pixels=99,spp=64", 10, 10)), 99u);
}

TEST(Probe, IsOnePass) {
    const Film film({0, 0, 8, 8}, 8, 8);
    const auto planner = MakePlanner("probe");
    EXPECT_FALSE(planner->NextPass({film, 1'000'000}).counts.empty());
    const Plan last = planner->NextPass({film, 1'000'000});
    EXPECT_TRUE(last.counts.empty());
    EXPECT_EQ(last.reason, "every probed pixel has its samples");
}

TEST(Probe, AnyPixelIsAsLikely) {
    // Of 400 pixels 40 a time, 2000 times: each 200 times, deviation sqrt(2000 x .1 x .9) = 13.4;
    // the largest of 400 is below 4.5 of them but once in 400 / 1.5e5.
    std::vector<int> times(400);
    for (int salt = 0; salt < 2000; ++salt) {
        const auto counts = FirstPass("probe:pixels=40,spp=2,salt=" + std::to_string(salt), 20, 20);
        for (std::size_t i = 0; i < counts.size(); ++i) {
            times[i] += counts[i] != 0;
        }
    }
    EXPECT_THAT(times, testing::Each(testing::AllOf(testing::Ge(200 - 60), testing::Le(200 + 60))));
}

TEST(Probe, MeetsTheBudgetWithWholePairs) {
    const auto sum = [](const std::vector<std::uint32_t>& counts) {
        return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
    };
    EXPECT_EQ(sum(FirstPass("probe:pixels=10,spp=64", 20, 20, 640)), 640u);
    EXPECT_EQ(sum(FirstPass("probe:pixels=10,spp=64", 20, 20, 639)), 620u);
    EXPECT_EQ(sum(FirstPass("probe:pixels=10,spp=64", 20, 20, 20)), 20u);
    const Film film({0, 0, 20, 20}, 20, 20);
    const Plan none = MakePlanner("probe:pixels=10,spp=64")->NextPass({film, 19});
    EXPECT_TRUE(none.counts.empty());
    EXPECT_EQ(none.reason, kBudgetSpent);
}

TEST(Probe, ChecksItsParameters) {
    for (const char* text :
         {"probe:pixels=0", "probe:spp=3", "probe:spp=0", "probe:salt=-1", "probe:salts=1"}) {
        EXPECT_THROW(MakePlanner(text), Error) << text;
    }
    EXPECT_EQ(MakePlanner(MakePlanner("probe:salt=7")->Describe())->Describe(),
              "probe:pixels=1024,spp=256,salt=7");
}

}  // namespace
}  // namespace relume::jobs
