#include "server/jobs/budgeted_planner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "server/jobs/pass.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

void RenderAll(Pass* pass, Film* film) {
    for (std::size_t unit = 0; unit < pass->unit_count(); ++unit) {
        pass->Accept(unit, PseudoRender(pass->Task(unit)));
        pass->Merge(pass->TileOf(unit), true, film);
    }
}

double NoTime() { return 0; }

// Renders a job to its end, at a speed, in simulated time.
class BudgetedJob {
  public:
    BudgetedJob(const std::string& sampler, const Budgets& budgets, Estimators estimators = {})
        : planner_(MakePlanner(sampler), budgets, std::move(estimators)),
          planned_(film_.pixel_count(), 0) {}

    // The stop; passes() has what came before.
    Stop Run() {
        for (int i = 0; i < 500; ++i) {
            auto pass = planner_.NextPass({film_, planned_, nullptr, done_, done_ > 0 ? speed : 0,
                                           [this] { return seconds_; }});
            last_ = pass;
            if (pass.stop) {
                EXPECT_TRUE(pass.plan.counts.empty());
                return *pass.stop;
            }
            Pass render(film_.window(), 16, planned_, pass.plan.counts);
            RenderAll(&render, &film_);
            planned_ = render.NextFirst();
            passes_.push_back(render.total_samples());
            plans_.push_back(std::move(pass.plan));
            done_ += passes_.back();
            seconds_ += static_cast<double>(passes_.back()) / speed;
        }
        ADD_FAILURE() << "no end";
        return {StopReason::kSampler, ""};
    }

    const Film& film() const { return film_; }
    const std::vector<std::uint64_t>& passes() const { return passes_; }
    const std::vector<Plan>& plans() const { return plans_; }
    const std::vector<std::uint32_t>& planned() const { return planned_; }
    const BudgetedPlanner::Pass& last() const { return last_; }
    double seconds() const { return seconds_; }

    double speed = 10'000;  // samples a second

  private:
    Film film_{{0, 0, 20, 10}, 20, 10};
    BudgetedPlanner planner_;
    std::vector<std::uint32_t> planned_;
    std::vector<std::uint64_t> passes_;
    std::vector<Plan> plans_;
    BudgetedPlanner::Pass last_;
    std::uint64_t done_ = 0;
    double seconds_ = 0;
};

TEST(BudgetedPlanner, SpendsSamplesAsThePlannerDoes) {
    Budgets budgets;
    budgets.samples = 6400;
    BudgetedJob job("uniform", budgets);
    EXPECT_EQ(job.Run().reason, StopReason::kSamples);
    EXPECT_THAT(job.passes(), ElementsAre(800, 800, 1600, 3200));
}

TEST(BudgetedPlanner, AJobThatIsSoonOverIsNotJudgedForAForecast) {
    for (const bool long_one : {false, true}) {
        int estimates = 0;
        Estimators estimators;
        estimators.error = [&](const Film&) { return ++estimates, 0.1; };
        estimators.filtered = true;
        Budgets budgets;
        budgets.samples = 200 * 64;
        BudgetedJob job("adaptive", budgets, estimators);
        job.speed = long_one ? 200 : 2000;  // a minute or six seconds
        job.Run();
        EXPECT_EQ(estimates, long_one ? 1 : 0);
    }
}

TEST(BudgetedPlanner, TheFirstPassHoldsTheMinimum) {
    Budgets budgets;
    budgets.samples = 200 * 20;
    budgets.min_spp = 11;
    BudgetedJob job("adaptive:pilot=4", budgets);
    job.Run();
    EXPECT_EQ(job.passes()[0], 200u * 12);
    EXPECT_THAT(job.planned(), Each(testing::Ge(12u)));
}

TEST(BudgetedPlanner, NoPixelGetsMoreThanTheMost) {
    Budgets budgets;
    budgets.max_spp = 21;
    BudgetedJob uniform("uniform", budgets);
    EXPECT_EQ(uniform.Run().reason, StopReason::kMaxSpp);
    EXPECT_THAT(uniform.planned(), Each(21u));
    budgets.samples = 200 * 16;
    for (const char* sampler : {"adaptive", "paper"}) {
        BudgetedJob job(sampler, budgets);
        job.Run();
        EXPECT_THAT(job.planned(), Each(testing::Le(21u)));
        EXPECT_EQ(*std::max_element(job.planned().begin(), job.planned().end()), 21u);
    }
    budgets.max_spp = 1;  // less than the first pass
    BudgetedJob one("uniform", budgets);
    EXPECT_EQ(one.Run().reason, StopReason::kMaxSpp);
    EXPECT_THAT(one.planned(), Each(1u));
}

// Wants two samples for each pixel, and says so.
class Insatiable final : public Planner {
  public:
    std::string Describe() const override { return "insatiable"; }
    std::string Save() const override { return {}; }
    void Restore(std::string_view) override {}
    FilmView View() const override { return FilmView::kNothing; }
    Plan NextPass(const PlanInput& input) override {
        const std::size_t n = input.film.pixel_count();
        return {
            std::vector<std::uint32_t>(n, 2), "", {}, std::vector<Decision>(n, Decision::kSampled)};
    }
};

TEST(BudgetedPlanner, TargetAndTimeNeedAFilm) {
    Budgets budgets;
    budgets.samples = 100;
    EXPECT_EQ(BudgetedPlanner(MakePlanner("uniform"), budgets, {}).View(), FilmView::kNothing);
    EXPECT_EQ(BudgetedPlanner(MakePlanner("paper"), budgets, {}).View(), FilmView::kWhole);
    budgets.seconds = 1;
    EXPECT_EQ(BudgetedPlanner(MakePlanner("uniform"), budgets, {}).View(), FilmView::kLagging);
    EXPECT_EQ(BudgetedPlanner(MakePlanner("paper"), budgets, {}).View(), FilmView::kWhole);
}

TEST(BudgetedPlanner, CappedPixelsAreMarked) {
    Film film({0, 0, 2, 1}, 2, 1);
    Budgets budgets;
    budgets.max_spp = 8;
    budgets.target = 0.125;
    BudgetedPlanner planner(std::make_unique<Insatiable>(), budgets,
                            {[](const Film&) { return 9.0; }, {}});
    const std::vector<std::uint32_t> planned{8, 7};
    Pass rendered(film.window(), 16, {0, 0}, planned);
    RenderAll(&rendered, &film);
    const auto pass = planner.NextPass({film, planned, nullptr, 15, 0, NoTime});
    EXPECT_THAT(pass.plan.counts, ElementsAre(0, 1));
    EXPECT_THAT(pass.plan.decisions, Each(Decision::kCapped));
}

TEST(BudgetedPlanner, ATargetWithoutOtherBudgetsEnds) {
    for (const char* sampler : {"uniform", "adaptive"}) {
        Budgets budgets;
        budgets.target = 0.02;
        BudgetedJob job(sampler, budgets);
        const Stop stop = job.Run();
        EXPECT_EQ(stop.reason, StopReason::kTarget);
        EXPECT_LE(job.film().EstimateRelMSE(), 0.02);
        EXPECT_GE(job.film().EstimateRelMSE(), 0.01);  // the noise of the estimate itself is large
        EXPECT_DOUBLE_EQ(job.last().error->error, job.film().EstimateRelMSE());
    }
}

TEST(BudgetedPlanner, TheImagesOwnErrorIsWhatTheTargetIsOf) {
    Budgets budgets;
    budgets.target = 0.01;
    const auto error = [](const Film& film) {
        const double n = film.TotalSamples() + film.TotalBadSamples();
        return 0.2 / std::sqrt(n / static_cast<double>(film.pixel_count()));
    };
    BudgetedJob job("uniform", budgets, {error, {}, true});
    EXPECT_EQ(job.Run().reason, StopReason::kTarget);
    EXPECT_GT(error(job.film()), 0.007);
    EXPECT_LE(error(job.film()), 0.01);
    EXPECT_DOUBLE_EQ(job.last().error->error, error(job.film()));
}

TEST(BudgetedPlanner, WhatTheFilmLacksIsCountedIn) {
    // Half of the pixels have half of their samples.
    Film film({0, 0, 20, 10}, 20, 10);
    std::vector<std::uint32_t> counts(film.pixel_count(), 64), planned(film.pixel_count(), 64);
    for (std::size_t i = 0; i < counts.size(); i += 2) {
        counts[i] = 32;
    }
    Pass pass(film.window(), 16, std::vector<std::uint32_t>(counts.size(), 0), counts);
    RenderAll(&pass, &film);
    Budgets budgets;
    budgets.samples = 1u << 30;
    budgets.target = 1e-6;
    BudgetedPlanner plain(MakePlanner("uniform"), budgets, {});
    double half = 0, whole = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        (i % 2 == 0 ? half : whole) += film.EstimateRelMSE(i) / 200;
    }
    const auto error = plain.NextPass({film, planned, nullptr, 9600, 0, NoTime}).error;
    EXPECT_EQ(error->samples, 12'800u);
    EXPECT_NEAR(error->error, 0.5 * half + whole, 1e-12);
    BudgetedPlanner filtered(MakePlanner("uniform"), budgets,
                             {[](const Film&) { return 1.0; }, {}, true});
    EXPECT_NEAR(filtered.NextPass({film, planned, nullptr, 9600, 0, NoTime}).error->error,
                2 / (1 + std::pow(2, 11.0 / 16)), 1e-12);
}

TEST(BudgetedPlanner, WhatIsRenderedWhileThePlanIsMadeCounts) {
    Film film({0, 0, 20, 10}, 20, 10);
    Budgets budgets;
    budgets.seconds = 10;
    double now = 1;
    BudgetedPlanner planner(MakePlanner("uniform:pilot=64"), budgets, {{}, [&](const Film&) {
                                                                           now += 2;
                                                                           return 1.0;
                                                                       }});
    const std::vector<std::uint32_t> planned(film.pixel_count(), 20);
    const auto pass = planner.NextPass({film, planned, nullptr, 1000, 1000, [&] { return now; }});
    // 10 s less 3, less 1 for the finish, less 0.2; 1000 more samples to come: 60 % of 4800.
    EXPECT_EQ(std::accumulate(pass.plan.counts.begin(), pass.plan.counts.end(), 0u), 2880u);
    EXPECT_EQ(pass.finish_seconds, 1);
}

// Takes 3 s for each pass.
class Slow final : public Planner {
  public:
    explicit Slow(double* now) : now_(now) {}
    std::string Describe() const override { return "slow"; }
    std::string Save() const override { return {}; }
    void Restore(std::string_view) override {}
    FilmView View() const override { return FilmView::kLagging; }
    Plan NextPass(const PlanInput& input) override {
        *now_ += 3;
        return {std::vector<std::uint32_t>(
                    input.film.pixel_count(),
                    static_cast<std::uint32_t>(input.budget / input.film.pixel_count())),
                "",
                {},
                {}};
    }

  private:
    double* now_;
};

TEST(BudgetedPlanner, TheTimeThatPlansTakeIsLeftFree) {
    Film film({0, 0, 20, 10}, 20, 10);
    Budgets budgets;
    budgets.seconds = 10;
    double now = 1;
    BudgetedPlanner planner(std::make_shared<Slow>(&now), budgets, {});
    const std::vector<std::uint32_t> planned(film.pixel_count(), 20);
    const auto pass = [&] {
        return planner.NextPass({film, planned, nullptr, 4000, 1000, [&] { return now; }});
    };
    // Not known at first: 60 % of 8.8 s. Then 5.8 s less 3 are left.
    EXPECT_NEAR(pass().plan.counts[0], 26, 1);
    EXPECT_NEAR(pass().plan.counts[0], 8, 1);
    EXPECT_EQ(pass().stop->reason, StopReason::kTimeLimit);
}

TEST(BudgetedPlanner, TimeIsMeasuredByAPairAPixelFirst) {
    Budgets budgets;
    budgets.seconds = 2;
    int asked = 0;
    BudgetedJob job("adaptive:pilot=8", budgets, {{}, [&](const Film&) {
                                                      ++asked;
                                                      return 0.5;
                                                  }});
    EXPECT_EQ(job.Run().reason, StopReason::kTimeLimit);
    EXPECT_EQ(asked, 1);
    EXPECT_EQ(job.last().finish_seconds, 0.5);
    EXPECT_EQ(job.passes()[0], 400u);
    EXPECT_EQ(job.passes()[1], 1200u);
    EXPECT_THAT(job.plans()[1].counts, Each(6u));
    EXPECT_GT(job.seconds(), 1.2);
    EXPECT_LT(job.seconds(), 1.5);
}

TEST(BudgetedPlanner, ALimitTooShortForTheFirstPassCutsIt) {
    Budgets budgets;
    budgets.seconds = 1;
    BudgetedJob job("adaptive:pilot=64", budgets);
    job.speed = 4000;  // 20 samples a pixel would fit
    EXPECT_EQ(job.Run().reason, StopReason::kTimeLimit);
    EXPECT_LT(job.seconds(), 1);
    EXPECT_GT(job.seconds(), 0.9);
    BudgetedJob slow("adaptive:pilot=64", budgets);
    slow.speed = 100;  // not even the first pair does
    const Stop stop = slow.Run();
    EXPECT_EQ(stop.reason, StopReason::kTimeLimit);
    EXPECT_THAT(stop.words, HasSubstr("2 samples a pixel; it is too short"));
    EXPECT_THAT(slow.planned(), Each(2u));
}

TEST(BudgetedPlanner, EachPassIsToldWithTheErrorThatIsExpected) {
    Budgets budgets;
    budgets.target = 1e-6;
    Film film({0, 0, 20, 10}, 20, 10);
    BudgetedPlanner planner(MakePlanner("uniform"), budgets, {});
    std::vector<std::uint32_t> planned(film.pixel_count(), 0);
    const auto first = planner.NextPass({film, planned, nullptr, 0, 0, NoTime});
    EXPECT_FALSE(first.expected_error);
    Pass pass(film.window(), 16, planned, first.plan.counts);
    RenderAll(&pass, &film);
    planned = pass.NextFirst();
    const auto second = planner.NextPass({film, planned, nullptr, 800, 0, NoTime});
    EXPECT_NEAR(*second.expected_error, film.EstimateRelMSE() / 2, 1e-12);
}

}  // namespace
}  // namespace relume::jobs
