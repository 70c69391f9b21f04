// Workers have work to the end, whoever is slow and however long plans take.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "tests/unit/jobs/virtual_farm.h"

namespace relume::jobs {
namespace {

constexpr TileRect kWindow{0, 0, 256, 192};
constexpr std::uint64_t kBudget = 64 * 256 * 192;

void ExpectSameFilm(const VirtualRun& run, const VirtualRun& reference, const std::string& what) {
    ASSERT_NE(run.film, nullptr) << what << ": " << run.info.message;
    for (int c = 0; c < kFilmChannelCount; ++c) {
        ASSERT_TRUE(std::ranges::equal(run.film->Plane(c), reference.film->Plane(c)))
            << what << ": channel " << FilmChannelNames()[static_cast<std::size_t>(c)];
    }
}

// Another planner with a barrier after each pass.
class WithBarrier final : public Planner {
  public:
    explicit WithBarrier(std::unique_ptr<Planner> planner) : planner_(std::move(planner)) {}
    std::string Describe() const override { return planner_->Describe(); }
    std::string Save() const override { return {}; }
    void Restore(std::string_view) override {}
    FilmView View() const override { return FilmView::kWhole; }
    Plan NextPass(const PlanInput& input) override { return planner_->NextPass(input); }

  private:
    std::unique_ptr<Planner> planner_;
};

class Busy : public testing::TestWithParam<const char*> {};

TEST_P(Busy, WorkersOfOneToFourTimesTheSpeedAreBusy) {
    // Small leases: at the end of a job all but one wait for the last one.
    for (const double plan_share : {0.02, 0.1}) {
        const VirtualRun run = RunVirtually(MakePlanner(GetParam()), kWindow, kBudget,
                                            {.plan_share = plan_share, .tile_size = 16});
        ASSERT_NE(run.film, nullptr);
        EXPECT_GE(run.info.passes.size(), 4u);
        EXPECT_GE(run.busy, 0.95) << "plans of " << plan_share << " of what was before";
    }
}

TEST_P(Busy, ABarrierCostsWhatItMust) {
    const VirtualRun run = RunVirtually(std::make_shared<WithBarrier>(MakePlanner(GetParam())),
                                        kWindow, kBudget, {.plan_share = 0.1, .tile_size = 16});
    ASSERT_NE(run.film, nullptr);
    EXPECT_LT(run.busy, 0.93);
}

TEST_P(Busy, BitsAreThoseOfOneWorkerAloneOfOtherTilesAndOfADeath) {
    const auto render = [&](const VirtualFarm& farm) {
        return RunVirtually(MakePlanner(GetParam()), kWindow, kBudget / 4, farm);
    };
    const VirtualRun alone = render({.speeds = {1e6}, .credits = 1, .plan_share = 0});
    ASSERT_NE(alone.film, nullptr);
    ExpectSameFilm(render({}), alone, "four workers");
    ExpectSameFilm(render({.plan_share = 0.5}), alone, "slow plans");
    ExpectSameFilm(render({.tile_size = 64}), alone, "large tiles");
    ExpectSameFilm(render({.tile_size = 24}), alone, "tiles across the cover's blocks");
    ExpectSameFilm(render({.kill_at = 0.2}), alone, "a death");
}

INSTANTIATE_TEST_SUITE_P(Samplers, Busy, testing::Values("uniform", "adaptive"),
                         [](const auto& tested) { return std::string(tested.param); });

}  // namespace
}  // namespace relume::jobs
