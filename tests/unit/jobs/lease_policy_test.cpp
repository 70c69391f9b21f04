#include "server/jobs/lease_policy.h"

#include <gtest/gtest.h>

namespace relume::jobs {
namespace {

TEST(LeasePolicy, DeadlineFollowsSpeedAndWhatIsBefore) {
    struct Case {
        WorkerPace pace;
        std::uint64_t samples;
        double predicted, deadline;
    };
    const Case cases[] = {
        {{0, 1, 0, false}, 1000, 0, kSceneLoadSeconds},
        // The speed is that of another scene: this one is still loading.
        {{1000, 1, 0, false}, 1000, 0, kSceneLoadSeconds},
        {{0, 1, 5000, true}, 1000, 0, kUnknownSpeedSeconds},
        {{1000, 1, 0, true}, 2000, 2, 8},
        {{1000, 1, 3000, true}, 2000, 5, 20},
        // One thread of four works on it, after all have shared what is before.
        {{1000, 4, 3000, true}, 2000, 11, 44},
        {{1e6, 1, 0, true}, 1000, 1e-3, kMinDeadlineSeconds},
        {{1e-300, 1, 0, true}, 1000, kMaxPredictedSeconds, kDeadlineFactor * kMaxPredictedSeconds},
    };
    for (const auto& c : cases) {
        EXPECT_DOUBLE_EQ(PredictSeconds(c.pace, c.samples), c.predicted);
        EXPECT_DOUBLE_EQ(DeadlineSeconds(c.pace, c.samples), c.deadline);
    }
}

TEST(LeasePolicy, RacesForTheOverdueAndWhereItIsSooner) {
    EXPECT_TRUE(ShouldRace(0, -kRaceGainSeconds));
    EXPECT_TRUE(ShouldRace(5, -1));
    EXPECT_TRUE(ShouldRace(1, 2));
    EXPECT_FALSE(ShouldRace(2, 1));
    EXPECT_FALSE(ShouldRace(0, 1));  // own speed not known
    // What is about to come is waited for.
    EXPECT_FALSE(ShouldRace(0, 0));
    EXPECT_FALSE(ShouldRace(1, 1 + kRaceGainSeconds / 2));
}

TEST(LeasePolicy, PausesGrowToAMinute) {
    EXPECT_EQ(ProblemPauseSeconds(1), 1);
    EXPECT_EQ(ProblemPauseSeconds(3), 4);
    EXPECT_EQ(ProblemPauseSeconds(50), 60);
}

TEST(LeasePolicy, TheLastWithAnAwaitedUnitIsWhoTakesLongerThanAllForTheRest) {
    // Four threads do 400 samples/s: 1000 awaited samples in 2.5 s, a unit of 100 in 1 s.
    EXPECT_FALSE(WouldBeLast(3.4, 100, 1000, 400, 4));
    EXPECT_TRUE(WouldBeLast(3.6, 100, 1000, 400, 4));
    EXPECT_FALSE(WouldBeLast(0, 100, 100, 400, 4));  // not measured yet
    // Alone, with as many leases as threads, one takes the next.
    EXPECT_FALSE(WouldBeLast(2, 100, 500, 400, 4));
}

}  // namespace
}  // namespace relume::jobs
