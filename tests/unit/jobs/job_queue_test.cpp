#include "server/jobs/job_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/jobs/job_queue_fixture.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

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
