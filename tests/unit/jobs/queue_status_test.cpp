#include "server/jobs/queue_status.h"

#include <gtest/gtest.h>

#include "server/jobs/job_queue.h"
#include "tests/unit/jobs/plan_now.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

class QueueStatusTest : public testing::Test {
  protected:
    // Three units of 16x16 pixels, at 4 samples a pixel.
    void AddJob(const std::string& name, std::optional<std::uint64_t> budget = kSamples) {
        JobSetup setup;
        setup.window = {0, 0, 48, 16};
        setup.display_width = 48;
        setup.display_height = 16;
        setup.tile_size = 16;
        setup.budgets.samples = budget;
        if (!budget) {
            setup.budgets.target = 0.01;
        }
        setup.planner = MakePlanner("uniform");
        queue.AddJob(name, std::move(setup), now);
    }
    WorkerId AddWorker(std::uint32_t credits) {
        const WorkerId id = queue.AddWorker("w", "avx2", 2, now);
        queue.SetCredits(id, credits, 0);
        return id;
    }
    std::optional<LeaseGrant> NextLease(WorkerId id) {
        auto lease = queue.NextLease(id, now);
        return lease || !PlanNow(&queue, now) ? lease : NextLease(id);
    }
    ResultVerdict Deliver(WorkerId id, const LeaseGrant& lease, double seconds = 2) {
        TileResult result = PseudoRender(lease.task);
        result.seconds = seconds;
        return queue.AddResult(id, lease.id, lease.job, std::move(result), now);
    }
    void Advance(double seconds) {
        now += FromSeconds(seconds);
        queue.Tick(now);
    }
    QueueStatus Status() const { return queue.Status(now, 100, 100); }

    static constexpr std::uint64_t kSamples = 48 * 16 * 4, kUnit = kSamples / 3;
    JobQueue queue;
    TimePoint now{};
};

TEST_F(QueueStatusTest, AnEmptyOneIsAllZero) {
    const QueueStatus s = Status();
    EXPECT_EQ(s.queued + s.rendering + s.filtering + s.units_waiting + s.unpredicted, 0u);
    EXPECT_EQ(s.core_seconds_left, 0);
    EXPECT_EQ(s.oldest_wait_seconds, 0);
    EXPECT_TRUE(s.under_way.empty());
    EXPECT_TRUE(s.workers.empty());
}

TEST_F(QueueStatusTest, FollowsAJobThroughItsStates) {
    AddJob("jobs/a");
    Advance(4);
    QueueStatus s = Status();
    EXPECT_EQ(s.queued, 1u);
    EXPECT_DOUBLE_EQ(s.oldest_wait_seconds, 4);
    EXPECT_EQ(s.unpredicted, 1u) << "no sample has been timed yet";
    EXPECT_TRUE(s.under_way.empty()) << "those that wait have no series";

    const WorkerId w = AddWorker(1);
    const auto first = NextLease(w);
    AddJob("jobs/b");
    Advance(1);
    s = Status();
    EXPECT_EQ(s.queued, 1u);
    EXPECT_EQ(s.rendering, 1u);
    EXPECT_EQ(s.leases_lent, 1u);
    EXPECT_EQ(s.units_waiting, 2u);
    EXPECT_EQ(s.active_pixels, 48u * 16u);
    EXPECT_EQ(s.totals.waited, 1u);
    EXPECT_DOUBLE_EQ(s.totals.wait_seconds, 4);
    EXPECT_DOUBLE_EQ(s.oldest_wait_seconds, 1) << "of the other job";
    EXPECT_EQ(s.workers_responding, 1u);
    EXPECT_EQ(s.threads, 2u);
    ASSERT_EQ(s.workers.size(), 1u);
    EXPECT_EQ(s.workers[0].leases_held, 1u);

    Deliver(w, *first, 2);
    s = Status();
    EXPECT_EQ(s.totals.samples, kUnit);
    EXPECT_DOUBLE_EQ(s.totals.busy_seconds, 2);
    EXPECT_EQ(s.unpredicted, 0u);
    // Two units of this job and, by its pace, three of the other.
    EXPECT_NEAR(s.core_seconds_left, 2 * 2 + 3 * 2, 1e-9);
    ASSERT_EQ(s.under_way.size(), 1u);
    EXPECT_EQ(s.under_way[0].name, "jobs/a");
    EXPECT_EQ(s.under_way[0].samples, kUnit);
    EXPECT_NEAR(s.under_way[0].core_seconds_left.value(), 4, 1e-9);
    EXPECT_FALSE(s.under_way[0].relmse) << "no pass has ended";

    for (int i = 0; i < 2; ++i) {
        const auto lease = NextLease(w);
        ASSERT_TRUE(lease);
        ASSERT_EQ(lease->job, "jobs/a");
        Deliver(w, *lease, 2);
    }
    s = Status();
    EXPECT_EQ(s.filtering, 1u);
    ASSERT_EQ(s.under_way.size(), 1u);
    EXPECT_EQ(s.under_way[0].state, JobState::kFiltering);
    EXPECT_GT(s.under_way[0].relmse.value(), 0);
    EXPECT_EQ(s.under_way[0].core_seconds_left.value(), 0);
    EXPECT_EQ(s.under_way[0].active_pixels, 0u);

    Outcome outcome;
    outcome.seconds = 1.5;
    queue.Succeed("jobs/a", outcome, now);
    queue.Cancel("jobs/b", now);
    s = Status();
    EXPECT_EQ(s.totals.succeeded, 1u);
    EXPECT_EQ(s.totals.cancelled, 1u);
    EXPECT_EQ(s.totals.filtered, 1u);
    EXPECT_DOUBLE_EQ(s.totals.filter_seconds, 1.5);
    EXPECT_TRUE(s.under_way.empty());
    EXPECT_EQ(s.oldest_wait_seconds, 0);
}

TEST_F(QueueStatusTest, TotalsDoNotFallWhenJobsAreForgotten) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(1);
    while (const auto lease = NextLease(w)) {
        Deliver(w, *lease);
    }
    queue.Fail("jobs/a", "for a test", now);
    const JobTotals before = Status().totals;
    EXPECT_EQ(before.failed, 1u);
    EXPECT_EQ(before.samples, kSamples);
    EXPECT_EQ(before.leases_issued, 3u);
    ASSERT_EQ(queue.ForgetOverJobs(0).size(), 1u);
    const JobTotals after = Status().totals;
    EXPECT_EQ(after.failed, before.failed);
    EXPECT_EQ(after.samples, before.samples);
    EXPECT_EQ(after.rays, before.rays);
    EXPECT_EQ(after.leases_issued, before.leases_issued);
    EXPECT_DOUBLE_EQ(after.busy_seconds, before.busy_seconds);
}

TEST_F(QueueStatusTest, TellsLateAndAbandonedLeasesAndSilentWorkers) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(1);
    const auto lease = NextLease(w);
    const double due = lease->deadline_seconds;
    for (double t = 0; t <= due; t += 1) {
        Advance(1);
        queue.Heard(w, now);
    }
    QueueStatus s = Status();
    EXPECT_EQ(s.leases_late, 1u);
    EXPECT_EQ(s.leases_lent, 0u);
    EXPECT_EQ(s.units_waiting, 3u) << "it goes to others as well";
    for (double t = 0; t <= kSilentSeconds; t += 1) {
        Advance(1);
    }
    s = Status();
    EXPECT_EQ(s.leases_late, 0u);
    EXPECT_EQ(s.leases_abandoned, 1u);
    EXPECT_EQ(s.workers_silent, 1u);
    EXPECT_EQ(s.workers_responding, 0u);
}

TEST_F(QueueStatusTest, CountsWrongAndDuplicateResults) {
    AddJob("jobs/a");
    const WorkerId w = AddWorker(1);
    const auto lease = NextLease(w);
    queue.RejectResult(w, lease->id, "for a test", now);
    EXPECT_EQ(Status().results_wrong, 1u);
    EXPECT_EQ(Deliver(w, *lease), ResultVerdict::kDuplicate);
    EXPECT_EQ(Status().totals.results_duplicate, 1u);
    NextLease(w);
    EXPECT_EQ(Status().totals.leases_issued, 2u);
    EXPECT_EQ(Status().totals.leases_reissued, queue.Get("jobs/a").leases_reissued);
}

TEST_F(QueueStatusTest, SeriesAreBoundedAndSumsAreNot) {
    const WorkerId w = AddWorker(100);
    AddWorker(0);
    for (const char* name : {"jobs/a", "jobs/b", "jobs/c"}) {
        AddJob(name);
        for (int i = 0; i < 3; ++i) {
            ASSERT_TRUE(NextLease(w));
        }
    }
    const QueueStatus s = queue.Status(now, 2, 1);
    EXPECT_EQ(s.rendering, 3u);
    EXPECT_EQ(s.leases_lent, 9u);
    EXPECT_EQ(s.threads, 4u);
    ASSERT_EQ(s.under_way.size(), 2u);
    EXPECT_EQ(s.under_way[0].name, "jobs/a");
    EXPECT_EQ(s.under_way[1].name, "jobs/b");
    ASSERT_EQ(s.workers.size(), 1u);
    EXPECT_EQ(s.workers[0].leases_held, 9u);
}

TEST_F(QueueStatusTest, AJobThatNoBudgetTellsOfIsCountedAsUnpredicted) {
    AddJob("jobs/a", std::nullopt);
    EXPECT_EQ(Status().unpredicted, 1u);
    EXPECT_EQ(Status().core_seconds_left, 0);
}

}  // namespace
}  // namespace relume::jobs
