#include "server/jobs/planner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "core/base/error.h"
#include "server/jobs/pass.h"
#include "server/jobs/spread.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

using testing::AnyOf;
using testing::Each;
using testing::HasSubstr;

std::uint64_t Sum(const std::vector<std::uint32_t>& counts) {
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

void Render(const std::vector<std::uint32_t>& counts, Film* film) {
    std::vector<std::uint32_t> first(counts.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
        first[i] = film->NextIndex(i);
    }
    Pass pass(film->window(), 16, first, counts);
    for (std::size_t unit = 0; unit < pass.unit_count(); ++unit) {
        pass.Accept(unit, PseudoRender(pass.Task(unit)));
        pass.Merge(pass.TileOf(unit), true, film);
    }
}

struct PlannedJob {
    std::vector<std::uint64_t> passes;  // samples
    std::string reason;
    std::uint64_t total = 0;
};

PlannedJob RunPlanner(const std::string& text, Film* film, std::uint64_t budget) {
    const auto planner = MakePlanner(text);
    PlannedJob run;
    for (;;) {
        const Plan plan = planner->NextPass({*film, budget - run.total});
        if (plan.counts.empty()) {
            run.reason = plan.reason;
            return run;
        }
        run.passes.push_back(Sum(plan.counts));
        run.total += run.passes.back();
        EXPECT_GT(run.passes.back(), 0u);
        EXPECT_LE(run.total, budget);
        if (run.total > budget || run.passes.size() > 2000) {
            return run;
        }
        Render(plan.counts, film);
    }
}

TEST(Planners, NamesAndParametersAreCheckedAndTheKnownOnesSaid) {
    for (const auto& [text, said] : std::vector<std::pair<std::string, std::string>>{
             {"unifrom", "known: uniform, adaptive, paper, gem, nlm, sbf, rd, wlr, probe"},
             {"", "known: uniform, adaptive, paper, gem, nlm, sbf, rd, wlr, probe"},
             {"uniform:pilott=4", "'pilott'; known: pilot"},
             {"uniform:pilot=3", "must be even"},
             {"uniform:pilot=many", "one number"},
             {"adaptive:pilot=2", "4 to 4096"},
             {"adaptive:mode=x", "'mode'; known: by, pilot"},
             {"paper:mode=robust", "printed, corrected"},
             {"paper:alpha=1-2-3-4", "1-4-16-32"},
             {"paper:pilot=2", "4 to 4096"},
             {"paper:passes=0", "1 to 10000"},
             {"paper:mode", "key=value"}}) {
        try {
            MakePlanner(text);
            ADD_FAILURE() << text << " was taken";
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument) << text;
            EXPECT_THAT(error.what(), HasSubstr(said));
        }
    }
}

TEST(Planners, DescribeThemselvesInAFormThatMakesThemAgain) {
    for (const char* text : {"uniform", "uniform:pilot=8", "adaptive", "adaptive:pilot=4", "paper",
                             "paper:mode=printed,alpha=1-4-16-32"}) {
        const std::string described = MakePlanner(text)->Describe();
        EXPECT_EQ(MakePlanner(described)->Describe(), described);
    }
    EXPECT_EQ(MakePlanner("paper")->Describe(),
              "paper:mode=corrected,alpha=1-2-4-8,pilot=4,passes=256");
}

TEST(Spread, IsEvenExactAndScattered) {
    for (const std::size_t pixels : {1u, 2u, 7u, 64u, 4096u, 100 * 75u}) {
        for (const std::uint64_t samples : {0u, 1u, 13u, 4096u, 50'001u}) {
            const auto counts = SpreadEvenly(pixels, samples, 2);
            EXPECT_EQ(Sum(counts), samples / 2 * 2);
            const auto low = static_cast<std::uint32_t>(samples / 2 / pixels * 2);
            EXPECT_THAT(counts, Each(AnyOf(low, low + 2)));
        }
    }
    // A quarter of the pixels of an 80x60 image: every 20x20 block gets about a quarter of its own.
    const auto counts = SpreadEvenly(80 * 60, 80 * 60 / 2, 2);
    for (int by = 0; by < 3; ++by) {
        for (int bx = 0; bx < 4; ++bx) {
            int chosen = 0;
            for (int i = 0; i < 400; ++i) {
                chosen +=
                    counts[static_cast<std::size_t>((20 * by + i / 20) * 80 + 20 * bx + i % 20)] >
                    0;
            }
            EXPECT_NEAR(chosen, 100, 20);
        }
    }
}

TEST(Spread, PilotLeavesNobodyOutForAPair) {
    EXPECT_THAT(SpreadPilot(100, 4, 10'000), Each(4u));
    EXPECT_THAT(SpreadPilot(100, 4, 100), Each(1u));
    EXPECT_THAT(SpreadPilot(100, 4, 150), Each(AnyOf(1u, 2u)));
    EXPECT_EQ(Sum(SpreadPilot(100, 4, 150)), 150u);
    EXPECT_THAT(SpreadPilot(100, 4, 250), Each(AnyOf(2u, 4u)));
    EXPECT_EQ(Sum(SpreadPilot(100, 4, 37)), 37u);
}

TEST(Spread, ScalesDownInProportionToASample) {
    std::vector<std::uint32_t> wanted(60 * 40);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        wanted[i] = 1u << (i / 7 % 4);
    }
    const std::uint64_t total = Sum(wanted);
    for (const std::uint64_t samples : {std::uint64_t{0}, std::uint64_t{1}, total / 3, total - 1}) {
        std::vector<std::uint32_t> counts = wanted;
        ScaleDown(samples, &counts);
        EXPECT_EQ(Sum(counts), samples);
        for (std::size_t i = 0; i < counts.size(); ++i) {
            const double part =
                static_cast<double>(wanted[i] * samples) / static_cast<double>(total);
            EXPECT_NEAR(counts[i], part, 1);
        }
    }
    std::vector<std::uint32_t> counts = wanted;
    ScaleDown(total + 5, &counts);
    EXPECT_EQ(counts, wanted);
    // Equal ones are served scattered: half a sample for each pixel of every 10x10 block.
    counts.assign(60 * 40, 1);
    ScaleDown(60 * 40 / 2, &counts);
    for (std::size_t block = 0; block < 24; ++block) {
        std::uint32_t got = 0;
        for (std::size_t i = 0; i < 100; ++i) {
            got += counts[(block / 6 * 10 + i / 10) * 60 + block % 6 * 10 + i % 10];
        }
        EXPECT_NEAR(got, 50, 8);
    }
}

TEST(Uniform, DoublesUntilTheBudgetIsSpent) {
    Film film({0, 0, 10, 10}, 10, 10);
    const PlannedJob run = RunPlanner("uniform", &film, 6400);
    EXPECT_THAT(run.passes, testing::ElementsAre(400, 400, 800, 1600, 3200));
    EXPECT_EQ(run.reason, kBudgetSpent);
}

TEST(Uniform, MeetsAnyBudgetToASampleWithEqualHalves) {
    for (const std::uint64_t budget : {100u, 130u, 250u, 333u, 500u, 777u, 1201u, 2000u}) {
        Film film({0, 0, 10, 10}, 10, 10);
        const PlannedJob run = RunPlanner("uniform", &film, budget);
        EXPECT_LE(budget - run.total, 1u);
        EXPECT_EQ(run.reason, kBudgetSpent);
        for (std::size_t i = 0; i < film.pixel_count(); ++i) {
            EXPECT_GT(film.NextIndex(i), 0u);
            EXPECT_TRUE(film.NextIndex(i) % 2 == 0 || budget < 200) << budget;
        }
    }
}

TEST(Paper, SpendsTheBudgetToASampleAndSaysSo) {
    for (const char* sampler : {"paper:mode=printed", "paper:mode=corrected"}) {
        for (const std::uint64_t budget : {33u, 32u * 32u, 32u * 32u * 4u, 32u * 32u * 6u + 1u}) {
            Film film({0, 0, 32, 32}, 32, 32);
            const PlannedJob run = RunPlanner(sampler, &film, budget);
            EXPECT_EQ(run.total, budget) << sampler;
            EXPECT_EQ(run.reason, kBudgetSpent) << sampler;
        }
    }
}

TEST(Paper, StopsAtItsPassLimit) {
    Film film({0, 0, 32, 32}, 32, 32);
    const PlannedJob run = RunPlanner("paper:passes=3", &film, 1'000'000);
    EXPECT_EQ(run.passes.size(), 3u);
    EXPECT_THAT(run.reason, HasSubstr("pass limit of 3"));
}

TEST(Paper, IsAFunctionOfTheFilmsAlone) {
    Film first({0, 0, 40, 24}, 40, 24), second({0, 0, 40, 24}, 40, 24);
    EXPECT_EQ(RunPlanner("paper", &first, 9000).passes, RunPlanner("paper", &second, 9000).passes);
}

}  // namespace
}  // namespace relume::jobs
