#include "server/jobs/job_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "tests/unit/jobs/plan_now.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class JobQueueTest : public testing::Test {
  protected:
    // Tiles of 16 on 48x16 pixels: three units in the pilot.
    void AddJob(const std::string& name, std::uint64_t budget = 48 * 16 * 4,
                std::uint64_t memory = 0) {
        JobSetup setup;
        setup.memory = memory;
        setup.owner = name;
        setup.window = {0, 0, 48, 16};
        setup.display_width = 48;
        setup.display_height = 16;
        setup.tile_size = 16;
        setup.budgets.samples = budget;
        setup.planner = MakePlanner("uniform");
        queue.AddJob(name, std::move(setup), now);
    }
    WorkerId AddWorker(std::uint32_t credits, const std::string& numeric_class = "avx2") {
        const WorkerId id = queue.AddWorker("w", numeric_class, 1, now);
        queue.SetCredits(id, credits, 0);
        return id;
    }
    // Plans whatever is to be planned at once.
    std::optional<LeaseGrant> NextLease(WorkerId id) {
        auto lease = queue.NextLease(id, now);
        return lease || !PlanNow(&queue, now) ? lease : NextLease(id);
    }
    std::vector<LeaseGrant> TakeAll(WorkerId id) {
        std::vector<LeaseGrant> leases;
        while (auto lease = NextLease(id)) {
            leases.push_back(std::move(*lease));
        }
        return leases;
    }
    ResultVerdict Deliver(WorkerId id, const LeaseGrant& lease) {
        return queue.AddResult(id, lease.id, lease.job, PseudoRender(lease.task), now);
    }
    void Advance(double seconds) { now += FromSeconds(seconds); }

    JobQueue queue;
    TimePoint now{};
};

// Else the end of the first pass, and so the next plan, would wait until all spare work is out.
TEST_F(JobQueueTest, WhatIsAwaitedGoesToTheNextOneAmongEquals) {
    AddJob("jobs/a", 48 * 16 * 64);
    std::vector<WorkerId> workers;
    for (int i = 0; i < 3; ++i) {
        workers.push_back(AddWorker(2));
        queue.SceneReady(workers.back(), "jobs/a", {}, now);
    }
    std::vector<LeaseGrant> first;
    for (const WorkerId w : workers) {
        first.push_back(*NextLease(w));
    }
    PlanNow(&queue, now);
    TakeAll(workers[0]);
    TakeAll(workers[1]);
    TakeAll(workers[2]);
    Advance(0.1);
    ASSERT_EQ(Deliver(workers[0], first[0]), ResultVerdict::kMerged);
    ASSERT_EQ(Deliver(workers[1], first[1]), ResultVerdict::kMerged);
    TakeAll(workers[0]);
    // The last unit of the first pass comes back; everybody has as much in hand.
    queue.ReturnLeases(workers[2], {first[2].id});
    const auto next = queue.NextLease(workers[1], now);
    ASSERT_TRUE(next);
    EXPECT_EQ(next->unit, first[2].unit);
}

TEST_F(JobQueueTest, LendsUpToTheCreditsAndFinishesTheJob) {
    AddJob("jobs/a");
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kQueued);
    const WorkerId w = AddWorker(2);
    auto leases = TakeAll(w);
    ASSERT_EQ(leases.size(), 2u);
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kRendering);
    EXPECT_EQ(Deliver(w, leases[0]), ResultVerdict::kMerged);
    EXPECT_EQ(Deliver(w, leases[1]), ResultVerdict::kMerged);
    EXPECT_FALSE(queue.TakeFilterWork().has_value());
    leases = TakeAll(w);
    ASSERT_EQ(leases.size(), 1u);
    Deliver(w, leases[0]);
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kFiltering);
    EXPECT_EQ(queue.Get("jobs/a").message, kBudgetSpent);
    const auto work = queue.TakeFilterWork();
    ASSERT_TRUE(work.has_value());
    EXPECT_EQ(work->film->TotalSamples() + work->film->TotalBadSamples(), 48 * 16 * 4);
    EXPECT_EQ(work->rays, 3);
    EXPECT_EQ(work->falls, 0) << "one pass tells nothing";
    EXPECT_FALSE(queue.TakeFilterWork().has_value());
    queue.Succeed("jobs/a", {}, now);
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kSucceeded);
    EXPECT_EQ(queue.Get("jobs/a").message, kBudgetSpent);
    EXPECT_TRUE(queue.Get("jobs/a").ended.has_value());
}

TEST_F(JobQueueTest, FilmsWithoutRoomWaitForThoseUnderWay) {
    queue.SetFilmMemory(1000);
    const auto state = [&](const char* job) { return queue.Get(job).state; };
    AddJob("jobs/a", 48 * 16 * 4, 600);
    AddJob("jobs/b", 48 * 16 * 4, 500);
    AddJob("jobs/c", 48 * 16 * 4, 400);
    AddJob("jobs/d", 48 * 16 * 4, 5000);
    const WorkerId w = AddWorker(100);
    const auto finish = [&](const char* job) {
        for (const LeaseGrant& lease : TakeAll(w)) {
            Deliver(w, lease);
        }
        while (const auto work = queue.TakeFilterWork()) {
            EXPECT_EQ(state(work->name.c_str()), JobState::kFiltering);
        }
        EXPECT_EQ(state(job), JobState::kFiltering);
    };
    finish("jobs/a");
    EXPECT_EQ(state("jobs/c"), JobState::kFiltering) << "fits beside the first";
    EXPECT_EQ(state("jobs/b"), JobState::kQueued);
    EXPECT_THAT(queue.Get("jobs/b").message, HasSubstr("--film-memory"));
    queue.Succeed("jobs/a", {}, now);
    finish("jobs/b");
    EXPECT_EQ(queue.Get("jobs/b").message, kBudgetSpent);
    EXPECT_EQ(state("jobs/d"), JobState::kQueued);
    queue.Cancel("jobs/b", now);
    EXPECT_FALSE(NextLease(w));
    queue.Fail("jobs/c", "of a test", now);
    finish("jobs/d");  // larger than all there may be: alone
}

TEST_F(JobQueueTest, AFilterIsToldHowTheNoiseHasFallen) {
    AddJob("jobs/a", 48 * 16 * 64);
    const WorkerId w = AddWorker(2);
    while (auto lease = NextLease(w)) {
        Deliver(w, *lease);
    }
    const auto work = queue.TakeFilterWork();
    ASSERT_TRUE(work.has_value());
    const auto& passes = queue.Get("jobs/a").passes;
    ASSERT_GT(passes.size(), 1u);
    // 16 times the samples of the pilot.
    EXPECT_NEAR(passes.front().relmse / passes.back().relmse, std::pow(16, work->falls), 1e-6);
    EXPECT_GT(work->falls, 0);
}

TEST_F(JobQueueTest, WithoutCreditsNothingIsLent) {
    AddJob("jobs/a");
    EXPECT_THAT(TakeAll(AddWorker(0)), IsEmpty());
}

TEST_F(JobQueueTest, LeasesOfAWorkerThatLeavesGoToOthers) {
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

TEST_F(JobQueueTest, ALateLeaseGoesToAnotherAndTheSecondAnswerIsDropped) {
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

TEST_F(JobQueueTest, ALateAnswerThatComesFirstIsTaken) {
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

TEST_F(JobQueueTest, ALoneWorkerThatLosesLeasesGetsThemAgain) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(3);
    ASSERT_EQ(TakeAll(w).size(), 3u);
    Advance(2 * kSceneLoadSeconds);
    queue.Heard(w, now);
    queue.Tick(now);
    EXPECT_EQ(TakeAll(w).size(), 3u);
}

TEST_F(JobQueueTest, AnIdleWorkerRacesForTheOldestLeaseWithAtMostTwoHolders) {
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

TEST_F(JobQueueTest, ASilentWorkerLosesItsLeasesAndComesBack) {
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

TEST_F(JobQueueTest, AServerThatWasAwayBlamesNobody) {
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

TEST_F(JobQueueTest, AWorkerThatIsChokedGetsNoMore) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(1);
    queue.SetCredits(w, 1, 2);
    EXPECT_THAT(TakeAll(w), IsEmpty());
    queue.SetCredits(w, 1, 1);  // a report that is older than its last result
    EXPECT_EQ(TakeAll(w).size(), 1u);
}

TEST_F(JobQueueTest, TimesBeyondReasonAreNotBelieved) {
    AddJob("jobs/a", 48 * 16 * 64);
    const WorkerId w = AddWorker(1);
    for (const double seconds : {1e6, 1e-300, 0.0}) {
        const auto lease = TakeAll(w);
        ASSERT_EQ(lease.size(), 1u);
        TileResult result = PseudoRender(lease[0].task);
        result.seconds = seconds;
        EXPECT_EQ(queue.AddResult(w, lease[0].id, "jobs/a", result, now), ResultVerdict::kMerged);
        const auto next = NextLease(w);
        ASSERT_TRUE(next.has_value());
        EXPECT_GE(next->deadline_seconds, kMinDeadlineSeconds);
        EXPECT_LE(next->deadline_seconds, kDeadlineFactor * kMaxPredictedSeconds);
        queue.ReturnLeases(w, {next->id});
    }
}

TEST_F(JobQueueTest, AWrongResultGoesElsewhereAndNamesTheWorker) {
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

TEST_F(JobQueueTest, ALoneWorkerThatIsAlwaysWrongEndsTheJob) {
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

TEST_F(JobQueueTest, TheFirstWorkersClassIsTheJobs) {
    AddJob("jobs/a");
    const WorkerId first = AddWorker(1, "avx2"), other = AddWorker(3, "sse2");
    const auto leases = TakeAll(first);
    EXPECT_THAT(TakeAll(other), IsEmpty());
    EXPECT_THAT(queue.Get("jobs/a").notes, ElementsAre(HasSubstr("(sse2) gets no leases")));
    // Nothing is merged yet: when the first gives up, the other may set the class.
    queue.ReturnLeases(first, {leases[0].id});
    const auto taken = TakeAll(other);
    ASSERT_EQ(taken.size(), 3u);
    Deliver(other, taken[0]);
    EXPECT_THAT(TakeAll(first), IsEmpty());
    queue.ReturnLeases(other, {taken[1].id, taken[2].id});
    EXPECT_THAT(TakeAll(first), IsEmpty());
}

TEST_F(JobQueueTest, OldestJobFirstAndIdleWorkersTakeFromTheNext) {
    AddJob("jobs/a");
    AddJob("jobs/b");
    const WorkerId w = AddWorker(5);
    const auto leases = TakeAll(w);
    std::vector<std::string> jobs;
    for (const auto& lease : leases) {
        jobs.push_back(lease.job);
    }
    EXPECT_THAT(jobs, ElementsAre("jobs/a", "jobs/a", "jobs/a", "jobs/b", "jobs/b"));
}

TEST_F(JobQueueTest, CancelRevokesAndDropsAnswers) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(3);
    const auto leases = TakeAll(w);
    queue.Cancel("jobs/a", now);
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kCancelled);
    EXPECT_THAT(queue.TakeRevoked(w), ElementsAre(leases[0].id, leases[1].id, leases[2].id));
    EXPECT_EQ(Deliver(w, leases[0]), ResultVerdict::kDuplicate);
    EXPECT_THAT(TakeAll(w), IsEmpty());
    queue.Succeed("jobs/a", {}, now);
    queue.Fail("jobs/a", "no", now);
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kCancelled);
}

TEST_F(JobQueueTest, ASceneProblemEndsTheJobWithTheWorkersWords) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(3);
    TakeAll(w);
    queue.Problem(w, "jobs/a", "room.gltf: byte 12: truncated", false, now);
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kFailed);
    EXPECT_EQ(queue.Get("jobs/a").message, "room.gltf: byte 12: truncated");
    queue.Problem(w, "jobs/unknown", "x", false, now);  // of a job that is forgotten: nothing
}

TEST_F(JobQueueTest, AProblemOfTheWorkersOwnPausesItAndLastsOnlySoLong) {
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

TEST_F(JobQueueTest, AnothersProgressKeepsAJobWithAProblematicWorkerAlive) {
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

TEST_F(JobQueueTest, WorkerNamesAreUniqueAndPrintable) {
    EXPECT_EQ(queue.WorkerName(queue.AddWorker("box", "c", 1, now)), "box");
    EXPECT_EQ(queue.WorkerName(queue.AddWorker("box", "c", 1, now)), "box#2");
    EXPECT_EQ(queue.WorkerName(queue.AddWorker("", "c", 1, now)), "worker");
    EXPECT_EQ(queue.WorkerName(queue.AddWorker("a\nb\x1b", "c", 1, now)), "a_b_");
}

TEST_F(JobQueueTest, SpeedIsMeasured) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(1);
    Deliver(w, TakeAll(w)[0]);
    // The pseudo renderer says a microsecond a sample.
    EXPECT_NEAR(queue.Workers(now)[0].samples_per_second, 1e6, 1);
    EXPECT_EQ(queue.Workers(now)[0].samples_done, 16u * 16u * 4u);
    EXPECT_DOUBLE_EQ(NextLease(w)->deadline_seconds, kMinDeadlineSeconds);
}

TEST_F(JobQueueTest, EventsTellTheStoryAndEndWithTheEnd) {
    AddJob("jobs/a", 48 * 16 * 8);
    const WorkerId w = AddWorker(6);
    for (int pass = 0; pass < 2; ++pass) {
        for (const auto& lease : TakeAll(w)) {
            Advance(1);
            Deliver(w, lease);
        }
    }
    Outcome outcome;
    outcome.image_sha256 = "abc";
    queue.Succeed("jobs/a", outcome, now);
    std::vector<JobState> states;
    std::uint64_t samples = 0, expected = 0;
    for (auto event = queue.FindEvent("jobs/a", 0); event;
         event = queue.FindEvent("jobs/a", event->number + 1)) {
        EXPECT_GT(event->number, expected);
        expected = event->number;
        EXPECT_GE(event->job->samples_done, samples);
        samples = event->job->samples_done;
        if (states.empty() || states.back() != event->job->state) {
            states.push_back(event->job->state);
        }
    }
    EXPECT_EQ(expected, queue.LastEvent("jobs/a"));
    // kept: the newest ones, so the first may be of the rendering
    EXPECT_EQ(states.back(), JobState::kSucceeded);
    EXPECT_EQ(queue.Get("jobs/a").passes.size(), 2u);
    EXPECT_GT(queue.Get("jobs/a").relmse, 0);
    EXPECT_GT(queue.Get("jobs/a").passes[0].relmse, queue.Get("jobs/a").passes[1].relmse);
    EXPECT_EQ(queue.Get("jobs/a").outcome->image_sha256, "abc");
}

TEST_F(JobQueueTest, ListsNewestFirstInPagesAndForgetsTheOldest) {
    for (const char* name : {"jobs/a", "jobs/b", "jobs/c", "jobs/d"}) {
        AddJob(name);
    }
    const auto page = queue.List(0, 2);
    ASSERT_EQ(page.size(), 2u);
    EXPECT_EQ(page[0]->name, "jobs/d");
    EXPECT_EQ(page[1]->name, "jobs/c");
    EXPECT_EQ(queue.List(page[1]->number, 9).front()->name, "jobs/b");
    EXPECT_EQ(queue.List(1, 9).size(), 0u);
    for (const char* name : {"jobs/a", "jobs/b", "jobs/d"}) {
        queue.Cancel(name, now);
    }
    EXPECT_THAT(queue.ForgetOverJobs(1), ElementsAre("jobs/a", "jobs/b"));
    EXPECT_EQ(queue.List(0, 9).size(), 2u);
    EXPECT_THROW(queue.Get("jobs/a"), Error);
    EXPECT_EQ(TakeAll(AddWorker(1))[0].job, "jobs/c");
}

TEST_F(JobQueueTest, NotesAreKeptOnceEach) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(1);
    queue.SceneReady(w, "jobs/a", {"no light", "camera fitted"}, now);
    queue.SceneReady(AddWorker(1), "jobs/a", {"no light"}, now);
    EXPECT_THAT(queue.Get("jobs/a").notes, ElementsAre("no light", "camera fitted"));
}

}  // namespace
}  // namespace relume::jobs
