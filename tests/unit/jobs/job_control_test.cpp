// Pausing, resuming and cancelling of jobs, and what is left of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "tests/unit/jobs/shared_farm.h"

namespace relume::jobs {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr std::uint64_t kSpp = 256;
const std::string kJob = "jobs/a";

class JobControl : public testing::Test {
  protected:
    JobControl() { farm.AddJob(kJob, "ann", 0, 1, kSpp); }

    const JobInfo& info() { return farm.queue.Get(kJob); }
    void ExpectWholeFilm() {
        SharedFarm alone({1e4});
        alone.AddJob(kJob, "ann", 0, 1, kSpp);
        alone.RunUntil(200);
        ASSERT_NE(farm.films[kJob], nullptr);
        for (int c = 0; c < kFilmChannelCount; ++c) {
            ASSERT_TRUE(std::ranges::equal(farm.films[kJob]->Plane(c), alone.films[kJob]->Plane(c)))
                << FilmChannelNames()[static_cast<std::size_t>(c)];
        }
    }

    SharedFarm farm{{1e4, 2e4}};
};

TEST_F(JobControl, APauseLetsLeasesDrainAndTheJobGoOnToTheSameBits) {
    farm.AddJob("jobs/b", "bob");
    farm.RunUntil(2);
    while (farm.Held(kJob) == 0) {
        farm.RunUntil(farm.now + 0.1);
    }
    const std::uint64_t done = info().samples_done;
    farm.queue.Pause(kJob, farm.At());
    EXPECT_TRUE(info().paused);
    EXPECT_FALSE(farm.queue.ShareOf(kJob, farm.At()).has_value());
    farm.lent.clear();
    farm.RunUntil(farm.now + 5);
    EXPECT_THAT(farm.lent, Not(Contains(kJob)));
    EXPECT_EQ(farm.Held(kJob), 0u);
    EXPECT_GT(info().samples_done, done) << "what was out is taken";
    EXPECT_EQ(info().state, JobState::kRendering);
    farm.queue.Resume(kJob, farm.At());
    farm.RunUntil(250);
    EXPECT_EQ(info().leases_reissued, 0u);
    ExpectWholeFilm();
}

TEST_F(JobControl, APausedJobIsNeitherStartedNorPlannedNorFiltered) {
    farm.queue.Pause(kJob, farm.At());
    farm.RunUntil(5);
    EXPECT_EQ(info().state, JobState::kQueued);
    EXPECT_THAT(farm.lent, Not(Contains(kJob)));
    farm.queue.Resume(kJob, farm.At());
    farm.RunUntil(5.3);
    farm.queue.Pause(kJob, farm.At());
    while (farm.Held(kJob) > 0) {
        farm.RunUntil(farm.now + 0.1);
    }
    EXPECT_FALSE(farm.queue.TakePlanWork(farm.At()).has_value());
    farm.queue.Resume(kJob, farm.At());
    // Until its last leases are out.
    while (farm.queue.Status(farm.At(), 1, 1).units_waiting > 0 ||
           info().samples_done + 4 * 8 * 8 * kMaxSamplesPerLease < kSpp * 64 * 64) {
        farm.RunUntil(farm.now + 0.01);
    }
    farm.queue.Pause(kJob, farm.At());
    farm.RunUntil(farm.now + 5);
    if (info().state == JobState::kFiltering) {
        EXPECT_EQ(farm.films.count(kJob), 0u) << "all samples are in, and it waits";
    }
    farm.queue.Resume(kJob, farm.At());
    farm.RunUntil(250);
    ExpectWholeFilm();
    EXPECT_THROW(farm.queue.Pause(kJob, farm.At()), Error) << "it is being filtered";
    farm.queue.Succeed(kJob, {}, farm.At());
    EXPECT_THROW(farm.queue.Pause(kJob, farm.At()), Error);
    EXPECT_THROW(farm.queue.Resume(kJob, farm.At()), Error);
    EXPECT_THROW(farm.queue.SetPriority(kJob, 1, farm.At()), Error);
}

TEST_F(JobControl, TimeInAPauseDoesNotCount) {
    farm.RunUntil(3);
    farm.queue.Pause(kJob, farm.At());
    farm.RunUntil(50);
    EXPECT_NEAR(ToSeconds(info().Used(farm.At())), 3, 1e-6);
    farm.queue.Pause(kJob, farm.At());  // changes nothing
    farm.queue.Resume(kJob, farm.At());
    farm.queue.Resume(kJob, farm.At());
    farm.RunUntil(51);
    EXPECT_NEAR(ToSeconds(info().Used(farm.At())), 4, 1e-6);
    EXPECT_NEAR(ToSeconds(info().down), 47, 1e-6);
    farm.queue.Pause(kJob, farm.At());
    farm.RunUntil(60);
    farm.queue.Cancel(kJob, farm.At());
    EXPECT_FALSE(info().paused);
    EXPECT_NEAR(ToSeconds(info().Used(farm.At())), 4, 1e-6);
}

TEST_F(JobControl, PausedJobsAreCountedAloneAndAskForNoWorkers) {
    farm.RunUntil(1);
    EXPECT_GT(farm.queue.Status(farm.At(), 10, 10).core_seconds_left, 0);
    farm.queue.Pause(kJob, farm.At());
    const QueueStatus status = farm.queue.Status(farm.At(), 10, 10);
    EXPECT_EQ(status.paused, 1u);
    EXPECT_EQ(status.queued + status.rendering + status.filtering, 0u);
    EXPECT_EQ(status.core_seconds_left, 0);
    EXPECT_EQ(status.units_waiting, 0u);
    ASSERT_EQ(status.under_way.size(), 1u);
    EXPECT_TRUE(status.under_way[0].paused);
}

TEST_F(JobControl, WatchersSeeAllOfIt) {
    farm.RunUntil(1);
    const auto next = [&] { return farm.queue.FindEvent(kJob, farm.queue.LastEvent(kJob))->job; };
    farm.queue.SetPriority(kJob, 5, farm.At());
    EXPECT_EQ(next()->priority, 5);
    farm.queue.Pause(kJob, farm.At());
    EXPECT_TRUE(next()->paused);
    EXPECT_FALSE(next()->eta);
    const std::uint64_t last = farm.queue.LastEvent(kJob);
    farm.queue.Pause(kJob, farm.At());
    EXPECT_EQ(farm.queue.LastEvent(kJob), last);
    farm.queue.Resume(kJob, farm.At());
    EXPECT_FALSE(next()->paused);
    farm.queue.CancelKeepingImage(kJob, farm.At());
    EXPECT_EQ(next()->state, JobState::kFiltering);
    EXPECT_EQ(next()->stop, StopReason::kCancelled);
}

TEST_F(JobControl, CancelKeepsAnImageOfWhatThereIs) {
    farm.RunUntil(2);
    ASSERT_GT(farm.Held(kJob), 0u);
    farm.queue.CancelKeepingImage(kJob, farm.At());
    EXPECT_EQ(info().state, JobState::kFiltering);
    auto work = farm.queue.TakeFilterWork();
    ASSERT_TRUE(work.has_value());
    EXPECT_TRUE(work->cancelled);
    const double samples = work->film->TotalSamples() + work->film->TotalBadSamples();
    EXPECT_GT(samples, 0);
    EXPECT_LT(samples, kSpp * 64 * 64);
    EXPECT_EQ(info().samples_done, samples) << "what waited for its turn is not counted";
    farm.RunUntil(3);
    EXPECT_EQ(farm.Held(kJob), 0u) << "its leases are revoked";
    farm.queue.CancelKeepingImage(kJob, farm.At());  // it comes to its end anyway
    EXPECT_EQ(info().state, JobState::kFiltering);
    farm.queue.Succeed(kJob, {}, farm.At());
    EXPECT_EQ(info().state, JobState::kCancelled);
    EXPECT_TRUE(info().outcome.has_value());
    EXPECT_EQ(info().message, "cancelled");
    farm.queue.CancelKeepingImage(kJob, farm.At());
    EXPECT_TRUE(info().outcome.has_value());
}

TEST_F(JobControl, WithoutASampleOrDiscardedThereIsNone) {
    farm.queue.CancelKeepingImage(kJob, farm.At());
    EXPECT_EQ(info().state, JobState::kCancelled);
    farm.AddJob("jobs/b", "ann", 0, 1, kSpp);
    farm.RunUntil(2);
    farm.queue.CancelKeepingImage("jobs/b", farm.At());
    ASSERT_TRUE(farm.queue.TakeFilterWork().has_value());
    farm.queue.Cancel("jobs/b", farm.At());
    EXPECT_EQ(farm.queue.Get("jobs/b").state, JobState::kCancelled);
    farm.queue.Succeed("jobs/b", {}, farm.At());
    EXPECT_FALSE(farm.queue.Get("jobs/b").outcome.has_value());
}

TEST_F(JobControl, AnImageThatCantBeMadeLeavesACancelledJob) {
    farm.RunUntil(2);
    farm.queue.Pause(kJob, farm.At());
    farm.queue.CancelKeepingImage(kJob, farm.At());  // of a paused job, too
    ASSERT_TRUE(farm.queue.TakeFilterWork().has_value());
    farm.queue.Fail(kJob, "no memory", farm.At());
    EXPECT_EQ(info().state, JobState::kCancelled);
    EXPECT_THAT(info().message, HasSubstr("no image: no memory"));
}

TEST_F(JobControl, APlanUnderWayIsWaitedForAndDropped) {
    // By hand: the film must not change while the plan reads it.
    JobQueue queue;
    const TimePoint now{};
    queue.AddJob(kJob, SharedFarm::Setup("ann", 0, kSpp), now);
    const WorkerId w = queue.AddWorker("w", "class", 1, now);
    queue.SetCredits(w, 64, 0);
    queue.NextLease(w, now);
    queue.Planned(kJob, RunPlan(*queue.TakePlanWork(now)), now);
    const auto lease = queue.NextLease(w, now);
    ASSERT_TRUE(lease.has_value());
    queue.AddResult(w, lease->id, kJob, PseudoRender(lease->task), now);
    const auto other = queue.NextLease(w, now);
    const auto plan = queue.TakePlanWork(now);
    ASSERT_TRUE(plan.has_value()) << "uniform plans ahead";
    queue.CancelKeepingImage(kJob, now);
    EXPECT_EQ(queue.Get(kJob).state, JobState::kRendering);
    EXPECT_FALSE(queue.NeedsWorkers(kJob));
    EXPECT_FALSE(queue.NextLease(w, now).has_value());
    EXPECT_EQ(queue.AddResult(w, other->id, kJob, PseudoRender(other->task), now),
              ResultVerdict::kDuplicate);
    EXPECT_EQ(queue.AddLateResult(w, kJob, other->unit, PseudoRender(other->task), now),
              ResultVerdict::kDuplicate);
    EXPECT_THROW(queue.Pause(kJob, now), Error);
    EXPECT_FALSE(queue.TakeFilterWork().has_value());
    queue.Planned(kJob, RunPlan(*plan), now);
    const auto work = queue.TakeFilterWork();
    ASSERT_TRUE(work.has_value());
    EXPECT_EQ(work->film->TotalSamples() + work->film->TotalBadSamples(),
              static_cast<double>(lease->task.TotalSamples()));
}

TEST_F(JobControl, ACancelledJobIsTakenUpAgainAndEndsInTheSameBits) {
    farm.RunUntil(2.3);
    farm.queue.CancelKeepingImage(kJob, farm.At());
    const auto work = farm.queue.TakeFilterWork();
    ASSERT_TRUE(work.has_value());
    farm.queue.Succeed(kJob, {}, farm.At());
    auto checkpoint = DecodeCheckpoint(EncodeCheckpoint(*work->checkpoint));
    checkpoint.info = work->checkpoint->info;
    farm.queue.Extend(kJob, std::move(checkpoint), std::make_shared<Film>(*work->film),
                      SharedFarm::Setup("ann", 0, kSpp), farm.At());
    farm.RunUntil(250);
    EXPECT_EQ(info().stop, StopReason::kSamples);
    ASSERT_TRUE(info().audit.has_value());
    EXPECT_EQ(info().audit->problem, "");
    ExpectWholeFilm();
}

TEST_F(JobControl, SoIsOneThatIsCancelledWhileItsNextPassIsPlanned) {
    // By hand, with plans that look at the film, and covers that they are not to see.
    const TimePoint now{};
    std::shared_ptr<const Film> whole;
    for (const int cancel_at : {-1, 0, 3, 40, 70, 95}) {  // results, with a plan under way or not
        JobQueue queue;
        queue.AddJob(kJob, SharedFarm::Setup("ann", 0, 16, "adaptive"), now);
        const WorkerId w = queue.AddWorker("w", "class", 1, now);
        queue.SetCredits(w, 3, 0);
        std::optional<JobQueue::FilterWork> work;
        bool cancelled = cancel_at < 0;
        for (int results = 0, step = 0; !work && step < 10'000; ++step) {
            auto plan = queue.TakePlanWork(now);
            const auto lease = queue.NextLease(w, now);
            if (lease) {
                queue.AddResult(w, lease->id, kJob, PseudoRender(lease->task), now);
                ++results;
            }
            if (!cancelled && results > cancel_at && (plan || cancel_at % 10 != 0)) {
                cancelled = true;
                queue.CancelKeepingImage(kJob, now);
                if (plan) {
                    queue.Planned(kJob, RunPlan(*plan), now);
                    plan.reset();
                }
                auto part = queue.TakeFilterWork();
                ASSERT_TRUE(part.has_value()) << cancel_at;
                queue.Succeed(kJob, {}, now);
                auto checkpoint = DecodeCheckpoint(EncodeCheckpoint(*part->checkpoint));
                checkpoint.info = part->checkpoint->info;
                queue.Extend(kJob, std::move(checkpoint), std::make_shared<Film>(*part->film),
                             SharedFarm::Setup("ann", 0, 16, "adaptive"), now);
            }
            if (plan) {
                queue.Planned(kJob, RunPlan(*plan), now);
            }
            work = queue.TakeFilterWork();
        }
        ASSERT_TRUE(work.has_value() && cancelled) << cancel_at;
        EXPECT_EQ(queue.Get(kJob).audit->problem, "") << cancel_at;
        whole = whole ? whole : work->film;
        for (int c = 0; c < kFilmChannelCount; ++c) {
            ASSERT_TRUE(std::ranges::equal(work->film->Plane(c), whole->Plane(c)))
                << cancel_at << ": " << FilmChannelNames()[static_cast<std::size_t>(c)];
        }
    }
}

TEST_F(JobControl, ARestartKeepsAPauseAndFinishesWhatWasCancelled) {
    farm.RunUntil(2);
    auto tiles = std::make_shared<std::vector<std::string>>(64);
    ASSERT_TRUE(farm.queue.BeginCopy(
        kJob, [&](std::size_t tile, std::string bytes) { (*tiles)[tile] = std::move(bytes); }));
    ASSERT_FALSE(farm.queue.CopyTiles(kJob, 100));
    const auto checkpoint = farm.queue.TakeCopied(kJob);
    ASSERT_TRUE(checkpoint.has_value());
    const auto restart = [&](bool paused, bool cancelled) {
        JobQueue queue;
        SavedJob saved;
        saved.info = checkpoint->info;
        saved.cancelled = cancelled;
        if (paused) {
            saved.info.paused = farm.At();
        }
        saved.checkpoint = checkpoint;
        saved.film = std::make_shared<Film>(checkpoint->window, 64, 64);
        const auto rects = CutIntoTiles(checkpoint->window, 8);
        for (std::size_t i = 0; i < rects.size(); ++i) {
            saved.film->LoadTile(rects[i], (*tiles)[i]);
        }
        queue.RestoreJob(std::move(saved), SharedFarm::Setup("ann", 3, kSpp), farm.At());
        return queue;
    };
    JobQueue paused = restart(true, false);
    const WorkerId w = paused.AddWorker("w", "class", 1, farm.At());
    paused.SetCredits(w, 2, 0);
    EXPECT_FALSE(paused.NextLease(w, farm.At()).has_value());
    EXPECT_EQ(paused.Get(kJob).priority, 3);
    EXPECT_EQ(paused.Get(kJob).owner, "ann");
    paused.Resume(kJob, farm.At());
    EXPECT_TRUE(paused.NextLease(w, farm.At()).has_value());

    JobQueue cancelled = restart(false, true);
    const auto work = cancelled.TakeFilterWork();
    ASSERT_TRUE(work.has_value());
    EXPECT_TRUE(work->cancelled);
    cancelled.Succeed(kJob, {}, farm.At());
    EXPECT_EQ(cancelled.Get(kJob).state, JobState::kCancelled);

    JobQueue without;  // its film is lost
    SavedJob saved;
    saved.info = checkpoint->info;
    saved.cancelled = true;
    without.RestoreJob(std::move(saved), SharedFarm::Setup("ann", 0, kSpp), farm.At());
    EXPECT_EQ(without.Get(kJob).state, JobState::kCancelled);
    EXPECT_THAT(without.TakeOver(), Contains(kJob));
}

}  // namespace
}  // namespace relume::jobs
