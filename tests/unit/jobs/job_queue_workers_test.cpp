// Workers that are late, silent, gone or wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/jobs/job_queue_fixture.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using JobQueueWorkersTest = JobQueueTest;

TEST_F(JobQueueWorkersTest, LeasesOfAWorkerThatLeavesGoToOthers) {
    AddJob("jobs/a");
    const WorkerId lost = AddWorker(3);
    ASSERT_EQ(TakeAll(lost).size(), 3u);
    queue.TakeNews();
    queue.RemoveWorker(lost);
    EXPECT_TRUE(queue.TakeNews());
    const WorkerId w = AddWorker(3);
    for (const auto& lease : TakeAll(w)) {
        EXPECT_EQ(Deliver(w, lease), ResultVerdict::kMerged);
    }
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kFiltering);
    EXPECT_EQ(queue.Get("jobs/a").leases_issued, 6u);
    EXPECT_EQ(queue.Get("jobs/a").leases_reissued, 3u);
}

TEST_F(JobQueueWorkersTest, ALateLeaseGoesToAnotherAndTheSecondAnswerIsDropped) {
    AddJob("jobs/a");
    const WorkerId slow = AddWorker(1), fast = AddWorker(3);
    queue.SceneReady(slow, "jobs/a", {}, now);
    const auto late = TakeAll(slow);
    ASSERT_EQ(late.size(), 1u);
    EXPECT_DOUBLE_EQ(late[0].deadline_seconds, kUnknownSpeedSeconds);
    Advance(5);
    queue.Heard(slow, now);
    queue.Heard(fast, now);
    queue.Tick(now);
    ASSERT_EQ(TakeAll(fast).size(), 2u);  // the other two; busy, it does not race
    for (int i = 0; i < 6; ++i) {
        Advance(5);
        queue.Heard(slow, now);
        queue.Heard(fast, now);
        queue.Tick(now);
    }
    const auto again = TakeAll(fast);
    ASSERT_EQ(again.size(), 1u);
    EXPECT_EQ(again[0].task.rect, late[0].task.rect);
    EXPECT_EQ(Deliver(fast, again[0]), ResultVerdict::kMerged);
    EXPECT_THAT(queue.TakeRevoked(slow), ElementsAre(late[0].id));
    EXPECT_EQ(Deliver(slow, late[0]), ResultVerdict::kDuplicate);
    EXPECT_EQ(queue.Get("jobs/a").results_duplicate, 1u);
    EXPECT_EQ(queue.Get("jobs/a").leases_reissued, 1u);
}

TEST_F(JobQueueWorkersTest, ALateAnswerThatComesFirstIsTaken) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(1);
    const auto lease = TakeAll(w);
    Advance(kSceneLoadSeconds + 1);
    queue.Heard(w, now);
    queue.Tick(now);
    EXPECT_EQ(Deliver(w, lease[0]), ResultVerdict::kMerged);
    // It is not lent again.
    std::size_t more = 0;
    for (auto next = TakeAll(w); !next.empty(); next = TakeAll(w)) {
        EXPECT_NE(next[0].task.rect, lease[0].task.rect);
        Deliver(w, next[0]);
        ++more;
    }
    EXPECT_EQ(more, 2u);
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kFiltering);
}

TEST_F(JobQueueWorkersTest, ALoneWorkerThatLosesLeasesGetsThemAgain) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(3);
    ASSERT_EQ(TakeAll(w).size(), 3u);
    Advance(2 * kSceneLoadSeconds);
    queue.Heard(w, now);
    queue.Tick(now);
    EXPECT_EQ(TakeAll(w).size(), 3u);
}

TEST_F(JobQueueWorkersTest, AnIdleWorkerRacesForTheOldestLeaseWithAtMostTwoHolders) {
    AddJob("jobs/a");
    const WorkerId first = AddWorker(3);
    const auto leases = TakeAll(first);
    ASSERT_EQ(leases.size(), 3u);
    const WorkerId second = AddWorker(3), third = AddWorker(3), fourth = AddWorker(3);
    EXPECT_THAT(TakeAll(second), IsEmpty());  // they may come at any moment
    Advance(2 * kRaceGainSeconds);
    // One thread, one raced lease at a time.
    const auto raced = TakeAll(second);
    ASSERT_EQ(raced.size(), 1u);
    EXPECT_EQ(raced[0].task.rect, leases[0].task.rect);
    ASSERT_EQ(TakeAll(third).size(), 1u);
    ASSERT_EQ(TakeAll(fourth).size(), 1u);
    EXPECT_THAT(TakeAll(AddWorker(3)), IsEmpty());
    EXPECT_EQ(Deliver(second, raced[0]), ResultVerdict::kMerged);
    EXPECT_THAT(queue.TakeRevoked(first), ElementsAre(leases[0].id));
    EXPECT_EQ(Deliver(first, leases[1]), ResultVerdict::kMerged);
    EXPECT_THAT(queue.TakeRevoked(third), testing::SizeIs(1));
}

TEST_F(JobQueueWorkersTest, ASilentWorkerLosesItsLeasesAndComesBack) {
    AddJob("jobs/a");
    const WorkerId silent = AddWorker(3);
    const auto leases = TakeAll(silent);
    Advance(kSilentSeconds - 1);
    queue.Tick(now);
    EXPECT_EQ(queue.Workers(now)[0].leases_held, 3u);
    Advance(2);
    queue.Tick(now);
    EXPECT_EQ(queue.Workers(now)[0].leases_held, 0u);
    EXPECT_THAT(TakeAll(silent), IsEmpty());
    const WorkerId other = AddWorker(1);
    const auto taken = TakeAll(other);
    ASSERT_EQ(taken.size(), 1u);
    Deliver(other, taken[0]);
    EXPECT_THAT(queue.TakeRevoked(silent), testing::SizeIs(1));
    // It wakes: what nobody else did is still welcome, and it gets leases again.
    queue.Heard(silent, now);
    int merged = 0;
    for (const auto& lease : leases) {
        merged += Deliver(silent, lease) == ResultVerdict::kMerged ? 1 : 0;
    }
    EXPECT_EQ(merged, 2);
    EXPECT_EQ(queue.Get("jobs/a").results_duplicate, 1u);
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kFiltering);
}

TEST_F(JobQueueWorkersTest, AServerThatWasAwayBlamesNobody) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(3), other = AddWorker(0);
    queue.SceneReady(w, "jobs/a", {}, now);
    queue.Tick(now);
    const auto leases = TakeAll(w);
    Advance(10 * kUnknownSpeedSeconds);  // stopped, or planning a pass
    queue.Tick(now);
    queue.SetCredits(other, 3, 0);
    EXPECT_EQ(queue.Workers(now)[0].leases_held, 3u);
    Advance(kSilentSeconds - 6);
    queue.Tick(now);
    EXPECT_EQ(queue.Workers(now)[0].leases_held, 3u);
    Advance(5);
    queue.Tick(now);
    Advance(5);
    queue.Tick(now);  // now it is the worker that is silent
    EXPECT_EQ(queue.Workers(now)[0].leases_held, 0u);
}

TEST_F(JobQueueWorkersTest, AWorkerThatIsChokedGetsNoMore) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(1);
    queue.SetCredits(w, 1, 2);
    EXPECT_THAT(TakeAll(w), IsEmpty());
    queue.SetCredits(w, 1, 1);  // a report that is older than its last result
    EXPECT_EQ(TakeAll(w).size(), 1u);
}

TEST_F(JobQueueWorkersTest, AWrongResultGoesElsewhereAndNamesTheWorker) {
    AddJob("jobs/a");
    const WorkerId odd = AddWorker(3), good = AddWorker(3);
    const auto leases = TakeAll(odd);
    TileResult result = PseudoRender(leases[0].task);
    result.planes[0] += 1;
    EXPECT_EQ(queue.AddResult(odd, leases[0].id, "jobs/a", result, now), ResultVerdict::kWrong);
    EXPECT_THAT(queue.Get("jobs/a").notes, Contains(HasSubstr("worker w: wrong result")));
    EXPECT_THAT(TakeAll(odd), IsEmpty());
    const auto again = TakeAll(good);
    ASSERT_FALSE(again.empty());
    EXPECT_EQ(again[0].task.rect, leases[0].task.rect);
    EXPECT_EQ(Deliver(good, again[0]), ResultVerdict::kMerged);
    EXPECT_EQ(queue.RejectResult(odd, leases[1].id, "too short", now), ResultVerdict::kWrong);
    EXPECT_THAT(queue.Get("jobs/a").notes, Contains(HasSubstr("too short")));
}

TEST_F(JobQueueWorkersTest, ALoneWorkerThatIsAlwaysWrongEndsTheJob) {
    AddJob("jobs/a");
    const WorkerId odd = AddWorker(1);
    for (int i = 0; i < kMaxBadResults; ++i) {
        const auto leases = TakeAll(odd);
        ASSERT_EQ(leases.size(), 1u);
        queue.AddResult(odd, leases[0].id, "jobs/a", {}, now);
    }
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kFailed);
    EXPECT_THAT(queue.Get("jobs/a").message, HasSubstr("worker w"));
}

TEST_F(JobQueueWorkersTest, ASceneProblemEndsTheJobWithTheWorkersWords) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(3);
    TakeAll(w);
    queue.Problem(w, "jobs/a", "room.gltf: byte 12: truncated", false, now);
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kFailed);
    EXPECT_EQ(queue.Get("jobs/a").message, "room.gltf: byte 12: truncated");
    queue.Problem(w, "jobs/unknown", "x", false, now);  // of a job that is forgotten: nothing
}

TEST_F(JobQueueWorkersTest, AProblemOfTheWorkersOwnPausesItAndLastsOnlySoLong) {
    AddJob("jobs/a");
    const WorkerId full = AddWorker(3);
    for (int n = 1; n <= kMaxProblems; ++n) {
        std::vector<LeaseId> ids;
        for (const auto& lease : TakeAll(full)) {
            ids.push_back(lease.id);
        }
        EXPECT_EQ(ids.size(), 3u) << n;
        queue.Problem(full, "jobs/a", "disk full", true, now);
        queue.ReturnLeases(full, ids);
        EXPECT_THAT(TakeAll(full), IsEmpty());
        Advance(ProblemPauseSeconds(n) + 0.01);
        queue.Heard(full, now);
    }
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kFailed);
    EXPECT_THAT(queue.Get("jobs/a").message, HasSubstr("worker w: disk full"));
}

TEST_F(JobQueueWorkersTest, AnothersProgressKeepsAJobWithAProblematicWorkerAlive) {
    AddJob("jobs/a");
    const WorkerId good = AddWorker(1), full = AddWorker(1);
    const auto lease = TakeAll(good);
    queue.Problem(full, "jobs/a", "disk full", true, now);
    Deliver(good, lease[0]);
    for (int n = 0; n < 2 * kMaxProblems; ++n) {
        queue.Problem(full, "jobs/a", "disk full", true, now);
    }
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kRendering);
}

}  // namespace
}  // namespace relume::jobs
