// Plans are made apart from the queue, from a film that holds what the planner wants and no more.
#include "server/jobs/plan_work.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <new>
#include <utility>

#include "core/base/error.h"
#include "server/jobs/job_queue.h"
#include "tests/unit/jobs/plan_now.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

using testing::Each;
using testing::HasSubstr;

constexpr TileRect kWindow{0, 0, 64, 32};

// Calls a function for each plan.
class Scripted final : public Planner {
  public:
    using Script = std::function<Plan(const PlanInput&)>;
    Scripted(FilmView view, Script script) : view_(view), script_(std::move(script)) {}
    std::string Describe() const override { return "scripted"; }
    std::string Save() const override { return {}; }
    void Restore(std::string_view) override {}
    FilmView View() const override { return view_; }
    Plan NextPass(const PlanInput& input) override { return script_(input); }

  private:
    FilmView view_;
    Script script_;
};

class PlanWorkTest : public testing::Test {
  protected:
    void AddJob(FilmView view, Scripted::Script script, Guide guide = nullptr) {
        JobSetup setup;
        setup.window = kWindow;
        setup.display_width = kWindow.x1;
        setup.display_height = kWindow.y1;
        setup.tile_size = 16;
        setup.budgets.samples = 100 * kWindow.area();
        setup.planner = std::make_shared<Scripted>(view, std::move(script));
        setup.guide = std::move(guide);
        queue.AddJob("jobs/a", std::move(setup), now);
        worker = queue.AddWorker("w", "class", 1, now);
        queue.SetCredits(worker, 1000, 0);
    }
    // Leases whatever waits.
    std::vector<LeaseGrant> TakeAll() {
        std::vector<LeaseGrant> leases;
        while (auto lease = queue.NextLease(worker, now)) {
            leases.push_back(std::move(*lease));
        }
        return leases;
    }
    void Deliver(const LeaseGrant& lease) {
        queue.AddResult(worker, lease.id, lease.job, PseudoRender(lease.task), now);
    }
    const JobInfo& info() const { return queue.Get("jobs/a"); }

    JobQueue queue;
    TimePoint now{};
    WorkerId worker = 0;
};

Plan Even(std::uint32_t count) { return {std::vector(kWindow.area(), count), {}, {}, {}}; }

TEST_F(PlanWorkTest, ALaggingFilmHasAllButTheCoverAndWorkersGoOn) {
    std::vector<std::vector<std::uint32_t>> seen, planned;
    AddJob(FilmView::kLagging, [&](const PlanInput& input) {
        seen.emplace_back();
        for (std::size_t i = 0; i < kWindow.area(); ++i) {
            seen.back().push_back(input.film.NextIndex(i));
        }
        planned.emplace_back(input.planned.begin(), input.planned.end());
        EXPECT_EQ(input.guide, nullptr);
        return Even(8);
    });
    EXPECT_TRUE(TakeAll().empty());
    PlanNow(&queue, now);
    // All leases of a pass are out at once; they are answered last first.
    auto leases = TakeAll();
    for (std::uint32_t pass = 0; pass < 3; ++pass) {
        EXPECT_EQ(seen.size(), pass + 1);
        std::optional<PlanWork> work;
        while (!leases.empty() && !work) {
            Deliver(leases.back());
            leases.pop_back();
            work = queue.TakePlanWork(now);
        }
        // Of the last pass nothing of the cover, though it came first.
        ASSERT_TRUE(work.has_value());
        EXPECT_TRUE(leases.empty());
        EXPECT_EQ(info().passes.size(), pass);
        queue.Planned("jobs/a", RunPlan(*work), now);
        EXPECT_EQ(info().passes.size(), pass + 1);
        EXPECT_THAT(planned.back(), Each(8 * (pass + 1)));
        std::size_t kept = 0;
        for (const std::uint32_t n : seen.back()) {
            kept += 8 * (pass + 1) - n;
        }
        EXPECT_EQ(kept, 2 * kWindow.area()) << pass;
        leases = TakeAll();
    }
    EXPECT_GT(info().plan_seconds, 0);
    EXPECT_GT(info().passes[1].plan_seconds, 0);
}

TEST_F(PlanWorkTest, RaysAreThoseOfTheFilmWhateverCameFirst) {
    std::vector<double> rays;
    AddJob(FilmView::kLagging, [&](const PlanInput& input) {
        rays.push_back(input.rays);
        return Even(8);
    });
    TakeAll();
    PlanNow(&queue, now);
    for (const std::size_t cover : {8u, 6u}) {  // leases from there on, and dear
        const auto leases = TakeAll();
        const auto deliver = [&](std::size_t k) {
            TileResult result = PseudoRender(leases[k].task);
            result.rays = leases[k].task.TotalSamples() * (k < cover ? 4 : 40);
            queue.AddResult(worker, leases[k].id, leases[k].job, std::move(result), now);
        };
        deliver(cover + 1);  // before the plan
        for (std::size_t k = 0; k < cover; ++k) {
            deliver(k);
        }
        PlanNow(&queue, now);
        for (std::size_t k = cover; k < leases.size(); ++k) {
            if (k != cover + 1) {
                deliver(k);
            }
        }
    }
    // Of eight tiles with 8 samples each the last 2, then six of the eight without the others.
    const double samples = 8 * 8 + 6 * 8, dear = 8 * 2;
    EXPECT_THAT(rays, testing::ElementsAre(
                          0, 4, testing::DoubleEq((4 * (samples - dear) + 40 * dear) / samples)));
}

TEST_F(PlanWorkTest, TheCoverIsLentAfterTheRestAndGoesOnWhileThePlanIsMade) {
    AddJob(FilmView::kLagging, [](const PlanInput&) { return Even(8); });
    TakeAll();
    PlanNow(&queue, now);
    const auto leases = TakeAll();
    ASSERT_EQ(leases.size(), 16u);
    for (std::size_t k = 0; k < leases.size(); ++k) {
        EXPECT_EQ(leases[k].task.count[0], k < 8 ? 6u : 2u);
        EXPECT_EQ(leases[k].task.first[0], k < 8 ? 0u : 6u);
    }
    for (std::size_t k = 0; k < 8; ++k) {
        EXPECT_FALSE(queue.TakePlanWork(now).has_value());
        Deliver(leases[k]);
    }
    const auto work = queue.TakePlanWork(now);
    ASSERT_TRUE(work.has_value());
    EXPECT_FALSE(queue.TakePlanWork(now).has_value());
    for (std::size_t k = 8; k < 16; ++k) {
        Deliver(leases[k]);
        EXPECT_EQ(work->film->NextIndex(0), 6u);
    }
    queue.Planned("jobs/a", RunPlan(*work), now);
    EXPECT_EQ(work->film->NextIndex(0), 8u);
    EXPECT_EQ(info().passes.size(), 1u);
    EXPECT_TRUE(queue.TakeNews());
}

TEST_F(PlanWorkTest, PlansThatDoNotLookAtTheFilmRunAhead) {
    int plans = 0;
    AddJob(FilmView::kNothing, [&](const PlanInput&) { return ++plans, Even(8); });
    TakeAll();
    PlanNow(&queue, now);
    EXPECT_EQ(plans, 3);
    for (const auto& lease : TakeAll()) {
        Deliver(lease);
        PlanNow(&queue, now);
    }
    EXPECT_EQ(plans, 6);
    EXPECT_EQ(info().passes.size(), 3u);
}

TEST_F(PlanWorkTest, AWholeFilmIsAwaited) {
    AddJob(FilmView::kWhole, [](const PlanInput& input) {
        EXPECT_EQ(input.film.NextIndex(0), input.planned[0]);
        return Even(8);
    });
    TakeAll();
    PlanNow(&queue, now);
    const auto leases = TakeAll();
    EXPECT_EQ(leases.size(), 8u);
    for (const auto& lease : leases) {
        EXPECT_FALSE(queue.TakePlanWork(now).has_value());
        Deliver(lease);
    }
    EXPECT_TRUE(PlanNow(&queue, now));
}

TEST_F(PlanWorkTest, AFailureEndsTheJob) {
    AddJob(FilmView::kLagging, [](const PlanInput& input) {
        if (input.planned[0] > 0) {
            throw std::bad_alloc();
        }
        return Even(8);
    });
    TakeAll();
    PlanNow(&queue, now);
    const auto leases = TakeAll();
    for (std::size_t k = 0; k < 8; ++k) {
        Deliver(leases[k]);
    }
    PlanNow(&queue, now);
    EXPECT_EQ(info().state, JobState::kFailed);
    EXPECT_THAT(info().message, HasSubstr("choose a smaller --size"));
    EXPECT_EQ(queue.TakeRevoked(worker).size(), 8u);
    EXPECT_EQ(queue.AddResult(worker, leases[9].id, "jobs/a", PseudoRender(leases[9].task), now),
              ResultVerdict::kDuplicate);
}

TEST_F(PlanWorkTest, APlanBeyondTheBudgetIsTheSamplersFault) {
    AddJob(FilmView::kLagging, [](const PlanInput&) { return Even(101); });
    TakeAll();
    PlanNow(&queue, now);
    EXPECT_EQ(info().state, JobState::kFailed);
    EXPECT_THAT(info().message, HasSubstr("sampler planned"));
}

TEST_F(PlanWorkTest, ThePlanOfACancelledJobIsDropped) {
    AddJob(FilmView::kLagging, [](const PlanInput&) { return Even(8); });
    TakeAll();
    const auto work = queue.TakePlanWork(now);
    ASSERT_TRUE(work.has_value());
    queue.Cancel("jobs/a", now);
    queue.Planned("jobs/a", RunPlan(*work), now);
    queue.Planned("jobs/unknown", RunPlan(*work), now);
    EXPECT_EQ(info().state, JobState::kCancelled);
    EXPECT_TRUE(TakeAll().empty());
}

TEST_F(PlanWorkTest, AJobTellsWhatIsExpectedAndWhyItStopped) {
    JobSetup setup;
    setup.window = kWindow;
    setup.display_width = kWindow.x1;
    setup.display_height = kWindow.y1;
    setup.tile_size = 16;
    setup.budgets.target = 0.05;
    setup.budgets.max_spp = 512;
    setup.planner = MakePlanner("uniform");
    setup.estimators.error = [](const Film& film) { return 2 * film.EstimateRelMSE(); };
    setup.estimators.filtered = true;
    queue.AddJob("jobs/a", std::move(setup), now);
    worker = queue.AddWorker("w", "class", 1, now);
    queue.SetCredits(worker, 1000, 0);
    TakeAll();
    PlanNow(&queue, now);
    EXPECT_FALSE(info().samples_budget);
    EXPECT_FALSE(info().predicted);
    while (info().state == JobState::kRendering) {
        const auto leases = TakeAll();
        ASSERT_FALSE(leases.empty());
        for (const auto& lease : leases) {
            now += FromSeconds(1e-4 * static_cast<double>(lease.task.TotalSamples()));
            Deliver(lease);
            PlanNow(&queue, now);
        }
    }
    EXPECT_EQ(info().state, JobState::kFiltering);
    EXPECT_EQ(info().stop, StopReason::kTarget);
    EXPECT_THAT(info().message, HasSubstr("target reached"));
    EXPECT_LE(*info().image_relmse, 0.05);
    EXPECT_NEAR(*info().image_relmse, 2 * info().relmse, 0.4 * info().relmse);
    ASSERT_GE(info().passes.size(), 2u);
    EXPECT_EQ(info().passes.back().image_relmse, info().image_relmse);
    EXPECT_FALSE(info().passes[0].relmse_predicted);
    EXPECT_NEAR(*info().passes[1].relmse_predicted, *info().passes[1].image_relmse,
                0.5 * *info().passes[1].image_relmse);
    ASSERT_TRUE(info().predicted);
    EXPECT_GT(info().predicted->seconds, 0.5 * ToSeconds(now.time_since_epoch()));
    EXPECT_LT(info().predicted->seconds, 2 * ToSeconds(now.time_since_epoch()));
    EXPECT_FALSE(info().forecast.empty());
}

TEST_F(PlanWorkTest, GuideGoesInAndTheLastSelectorComesOut) {
    const Guide guide = [](const Film& film, double) {
        return std::vector<float>(film.pixel_count(), 7);
    };
    int plans = 0;
    AddJob(
        FilmView::kLagging,
        [&](const PlanInput& input) {
            Plan plan = plans++ == 0 ? Even(8) : Plan{{}, "all done", {}, {}};
            plan.selector = (*input.guide)(input.film, 1);
            plan.selector[0] = static_cast<float>(plans);
            plan.decisions.assign(kWindow.area(), Decision::kConverged);
            return plan;
        },
        guide);
    TakeAll();
    PlanNow(&queue, now);
    for (const auto& lease : TakeAll()) {
        Deliver(lease);
        PlanNow(&queue, now);
    }
    EXPECT_EQ(info().state, JobState::kFiltering);
    EXPECT_EQ(info().message, "all done");
    const auto work = queue.TakeFilterWork();
    ASSERT_TRUE(work.has_value());
    EXPECT_EQ(work->film->NextIndex(0), 8u);
    EXPECT_EQ(work->selector[0], 2);
    EXPECT_EQ(work->selector[1], 7);
    EXPECT_THAT(work->decisions, Each(Decision::kConverged));
}

}  // namespace
}  // namespace relume::jobs
