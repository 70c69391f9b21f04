#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "core/base/error.h"
#include "server/jobs/job_queue.h"
#include "tests/unit/jobs/plan_now.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

constexpr TileRect kWindow{0, 0, 40, 24};

JobSetup SetupOf(const std::string& sampler, std::uint64_t spp) {
    JobSetup setup;
    setup.window = kWindow;
    setup.display_width = kWindow.x1;
    setup.display_height = kWindow.y1;
    setup.tile_size = 16;
    setup.budgets.samples = spp * kWindow.area();
    setup.planner = MakePlanner(sampler);
    return setup;
}

// Renders whatever the job wants until its samples are all in.
JobQueue::FilterWork Render(JobQueue* queue) {
    const TimePoint now{};
    const WorkerId worker = queue->AddWorker("w", "class", 1, now);
    queue->SetCredits(worker, 1, 0);
    for (int n = 0; n < 10'000; ++n) {
        PlanNow(queue, now);
        if (auto work = queue->TakeFilterWork()) {
            return std::move(*work);
        }
        if (const auto lease = queue->NextLease(worker, now)) {
            queue->AddResult(worker, lease->id, lease->job, PseudoRender(lease->task), now);
        }
    }
    return {};
}

std::shared_ptr<const Film> Direct(const std::string& sampler, std::uint64_t spp) {
    JobQueue queue;
    queue.AddJob("jobs/a", SetupOf(sampler, spp), {});
    return Render(&queue).film;
}

JobQueue::FilterWork Extended(const std::string& sampler, std::uint64_t from, std::uint64_t to,
                              JobInfo* info) {
    JobQueue queue;
    queue.AddJob("jobs/a", SetupOf(sampler, from), {});
    const JobQueue::FilterWork first = Render(&queue);
    queue.Succeed("jobs/a", {}, {});
    queue.Extend("jobs/a", *first.checkpoint, std::make_shared<Film>(*first.film),
                 SetupOf(sampler, to), {});
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kRendering);
    EXPECT_FALSE(queue.Get("jobs/a").outcome);
    JobQueue::FilterWork second = Render(&queue);
    *info = queue.Get("jobs/a");
    return second;
}

TEST(Extend, UniformByDoublingsEqualsTheLargerJob) {
    JobInfo info;
    const auto extended = Extended("uniform", 8, 32, &info);
    const auto direct = Direct("uniform", 32);
    ASSERT_NE(extended.film, nullptr);
    for (int c = 0; c < kFilmChannelCount; ++c) {
        EXPECT_TRUE(std::ranges::equal(extended.film->Plane(c), direct->Plane(c))) << c;
    }
    EXPECT_EQ(info.samples_done, 32 * kWindow.area());
    ASSERT_TRUE(info.audit);
    EXPECT_EQ(info.audit->problem, "");
}

TEST(Extend, AdaptiveGoesOnToTheNewBudget) {
    JobInfo info, again;
    const auto extended = Extended("adaptive", 8, 24, &info);
    ASSERT_NE(extended.film, nullptr);
    EXPECT_EQ(info.samples_done, 24 * kWindow.area());
    ASSERT_TRUE(info.audit);
    EXPECT_EQ(info.audit->problem, "");
    const auto twin = Extended("adaptive", 8, 24, &again);
    for (int c = 0; c < kFilmChannelCount; ++c) {
        EXPECT_TRUE(std::ranges::equal(extended.film->Plane(c), twin.film->Plane(c))) << c;
    }
}

// As after a server whose disk was full, or that died, when the last film was to be saved.
TEST(Extend, FromAFilmOlderThanTheEndCountsWhatIsInIt) {
    JobQueue queue;
    queue.AddJob("jobs/a", SetupOf("uniform", 8), {});
    const WorkerId worker = queue.AddWorker("early", "class", 1, {});
    queue.SetCredits(worker, 1, 0);
    auto lease = queue.NextLease(worker, {});
    for (int n = 0; n < 100 && !lease; ++n) {
        PlanNow(&queue, {});
        lease = queue.NextLease(worker, {});
    }
    ASSERT_TRUE(lease);
    queue.AddResult(worker, lease->id, lease->job, PseudoRender(lease->task), {});
    PlanNow(&queue, {});
    const auto rects = CutIntoTiles(kWindow, 16);
    const auto film = std::make_shared<Film>(kWindow, kWindow.x1, kWindow.y1);
    ASSERT_TRUE(queue.BeginCopy("jobs/a", [&](std::size_t tile, const std::string& bytes) {
        film->LoadTile(rects[tile], bytes);
    }));
    while (queue.CopyTiles("jobs/a", 1)) {
    }
    const auto older = queue.TakeCopied("jobs/a");
    ASSERT_TRUE(older);
    Render(&queue);
    queue.Succeed("jobs/a", {}, {});
    queue.Extend("jobs/a", *older, film, SetupOf("uniform", 32), {});
    EXPECT_LT(queue.Get("jobs/a").samples_done, 8 * kWindow.area());
    const auto extended = Render(&queue);
    const auto direct = Direct("uniform", 32);
    ASSERT_NE(extended.film, nullptr);
    EXPECT_TRUE(std::ranges::equal(extended.film->Plane(0), direct->Plane(0)));
    const JobInfo info = queue.Get("jobs/a");
    EXPECT_EQ(info.samples_done, 32 * kWindow.area());
    ASSERT_TRUE(info.audit);
    EXPECT_EQ(info.audit->problem, "");
}

TEST(Extend, OfAJobThatHasNotSucceededIsRefused) {
    JobQueue queue;
    queue.AddJob("jobs/a", SetupOf("uniform", 4), {});
    try {
        queue.Extend("jobs/a", {}, nullptr, SetupOf("uniform", 8), {});
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
    }
}

TEST(Extend, AFilmOfAnotherJobChangesNothing) {
    JobQueue queue;
    queue.AddJob("jobs/a", SetupOf("uniform", 4), {});
    const auto work = Render(&queue);
    queue.Succeed("jobs/a", {}, {});
    EXPECT_THROW(
        queue.Extend("jobs/a", *work.checkpoint, std::make_shared<Film>(TileRect{0, 0, 8, 8}, 8, 8),
                     SetupOf("uniform", 8), {}),
        Error);
    EXPECT_EQ(queue.Get("jobs/a").state, JobState::kSucceeded);
    EXPECT_TRUE(queue.Get("jobs/a").outcome);
}

}  // namespace
}  // namespace relume::jobs
