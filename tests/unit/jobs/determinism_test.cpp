#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/unit/jobs/simulation.h"

namespace relume::jobs {
namespace {

constexpr TileRect kWindow{5, 3, 75, 53};

void ExpectSameFilm(const FarmRun& run, const FarmRun& reference, const std::string& what) {
    ASSERT_NE(run.film, nullptr) << what << ": " << run.info.message;
    for (int c = 0; c < kFilmChannelCount; ++c) {
        ASSERT_TRUE(std::ranges::equal(run.film->Plane(c), reference.film->Plane(c)))
            << what << ": channel " << FilmChannelNames()[static_cast<std::size_t>(c)];
    }
}

class Farm : public testing::TestWithParam<const char*> {
  protected:
    static constexpr std::uint64_t kBudget = 9 * 70 * 50;
    FarmRun Render(int tile_size, const FarmHabits& habits, std::uint32_t seed) {
        return RunFarm(GetParam(), kWindow, tile_size, kBudget, habits, seed);
    }
};

TEST_P(Farm, BitsDependNeitherOnTilesNorOnWorkers) {
    const FarmRun reference = Render(32, {.workers = 1}, 1);
    ASSERT_NE(reference.film, nullptr);
    EXPECT_GT(reference.info.passes.size(), 1u);
    for (const int tile_size : {16, 32, 64}) {
        for (const int workers : {1, 2, 4}) {
            ExpectSameFilm(Render(tile_size, {.workers = workers}, 7), reference,
                           fmt::format("tiles of {}, {} workers", tile_size, workers));
        }
    }
}

TEST_P(Farm, BitsDoNotDependOnLossesDuplicatesAndDelays) {
    const FarmRun reference = Render(32, {.workers = 1}, 1);
    const FarmHabits habits[] = {
        {.workers = 3, .lose = 0.05},
        {.workers = 3, .twice = 0.3},
        {.workers = 3, .leave = 0.02},
        {.workers = 2, .hand_back = 0.2},
        {.workers = 3, .slow = 0.2},
        {.workers = 4,
         .lose = 0.02,
         .twice = 0.1,
         .leave = 0.01,
         .hand_back = 0.1,
         .wrong = 0.01,
         .slow = 0.1},
    };
    for (const auto& h : habits) {
        for (const std::uint32_t seed : {1u, 2u}) {
            const FarmRun run = Render(16, h, seed);
            ExpectSameFilm(
                run, reference,
                fmt::format("lose {} twice {} leave {} hand back {} wrong {} slow {} seed {}",
                            h.lose, h.twice, h.leave, h.hand_back, h.wrong, h.slow, seed));
            EXPECT_EQ(run.info.samples_done, reference.info.samples_done);
        }
    }
}

TEST_P(Farm, BitsDoNotDependOnTheServersDeath) {
    const FarmRun reference = Render(16, {.workers = 1}, 1);
    std::uint32_t restarts = 0, most = 0;
    for (const std::uint32_t seed : {1u, 2u, 3u, 4u, 5u, 6u}) {
        const FarmRun run = Render(16,
                                   {.workers = 3,
                                    .lose = 0.02,
                                    .twice = 0.1,
                                    .leave = 0.01,
                                    .slow = 0.1,
                                    .copy = 0.1,
                                    .kill = 0.03},
                                   seed);
        ExpectSameFilm(run, reference, fmt::format("seed {}", seed));
        restarts += run.info.restarts;
        most = std::max(most, run.info.restarts);
        EXPECT_EQ(run.info.samples_done, reference.info.samples_done);
        EXPECT_EQ(run.info.bad_samples, reference.info.bad_samples);
        EXPECT_EQ(run.info.rays, reference.info.rays);
        ASSERT_EQ(run.info.passes.size(), reference.info.passes.size());
        for (std::size_t i = 0; i < run.info.passes.size(); ++i) {
            EXPECT_EQ(run.info.passes[i].samples, reference.info.passes[i].samples);
            EXPECT_EQ(run.info.passes[i].relmse, reference.info.passes[i].relmse);
        }
        ASSERT_TRUE(run.info.audit);
        EXPECT_EQ(run.info.audit->problem, "");
    }
    EXPECT_GT(restarts, 8u);
    EXPECT_GT(most, 1u);
}

TEST_P(Farm, EverySampleIsCountedOnce) {
    const FarmRun run =
        Render(16, {.workers = 3, .lose = 0.03, .twice = 0.2, .leave = 0.01, .slow = 0.1}, 5);
    ASSERT_NE(run.film, nullptr);
    EXPECT_EQ(static_cast<std::uint64_t>(run.film->TotalSamples() + run.film->TotalBadSamples()),
              run.info.samples_done);
    EXPECT_EQ(static_cast<std::uint64_t>(run.film->TotalBadSamples()), run.info.bad_samples);
    EXPECT_EQ(run.info.rays, 3 * run.info.samples_done);
    std::uint64_t shares = 0, passes = 0;
    for (const auto& [name, share] : run.info.workers) {
        shares += share.samples;
    }
    for (const auto& pass : run.info.passes) {
        passes += pass.samples;
    }
    EXPECT_EQ(shares, run.info.samples_done);
    EXPECT_EQ(passes, run.info.samples_done);
    EXPECT_GT(run.info.results_duplicate, 0u);
    EXPECT_GT(run.info.leases_reissued, 0u);
    EXPECT_GT(run.info.leases_issued, run.info.leases_reissued);
    ASSERT_TRUE(run.info.audit);
    EXPECT_EQ(run.info.audit->problem, "");
    EXPECT_EQ(run.info.audit->samples, run.info.samples_done);
    EXPECT_EQ(run.info.audit->film_samples, run.info.samples_done);
    EXPECT_GT(run.info.audit->ranges, 0u);
}

std::string SamplerName(const testing::TestParamInfo<const char*>& tested) {
    const char* const names[] = {"Uniform", "Adaptive", "PaperPrinted", "PaperCorrected"};
    return names[tested.index];
}

INSTANTIATE_TEST_SUITE_P(Samplers, Farm,
                         testing::Values("uniform", "adaptive", "paper:mode=printed",
                                         "paper:mode=corrected"),
                         SamplerName);

TEST(FarmOfLayers, LeasesOfManySamplesMergeInOrder) {
    // 300 samples a pixel in the last pass: five layers.
    const auto render = [](int tile_size, const FarmHabits& habits, std::uint32_t seed) {
        return RunFarm("uniform:pilot=300", {0, 0, 20, 20}, tile_size, 2 * 300 * 400, habits, seed);
    };
    const FarmRun reference = render(32, {.workers = 1}, 1);
    ASSERT_NE(reference.film, nullptr);
    for (const std::uint32_t seed : {1u, 2u, 3u}) {
        ExpectSameFilm(render(8, {.workers = 4, .lose = 0.02, .twice = 0.1, .slow = 0.1}, seed),
                       reference, fmt::format("seed {}", seed));
    }
}

}  // namespace
}  // namespace relume::jobs
