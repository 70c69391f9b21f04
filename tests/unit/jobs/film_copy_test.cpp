// Copies of a film that are made while it goes on.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "core/film/aov.h"
#include "server/jobs/job_queue.h"
#include "tests/unit/jobs/plan_now.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

constexpr const char* kJob = "jobs/a";
const TileRect kWindow{0, 0, 64, 16};  // four tiles

JobSetup Setup(const std::string& sampler) {
    JobSetup setup;
    setup.window = kWindow;
    setup.display_width = kWindow.x1;
    setup.display_height = kWindow.y1;
    setup.tile_size = 16;
    setup.budgets.samples = kWindow.area() * 64;
    setup.planner = MakePlanner(sampler);
    return setup;
}

struct Farm {
    explicit Farm(const std::string& sampler) { queue.AddJob(kJob, Setup(sampler), {}); }
    explicit Farm(SavedJob saved, const std::string& sampler) {
        queue.RestoreJob(std::move(saved), Setup(sampler), {});
    }
    WorkerId Worker() {
        const WorkerId id = queue.AddWorker("w", "class", 1, {});
        queue.SetCredits(id, 1, 0);
        queue.SceneReady(id, kJob, {}, {});
        return id;
    }
    // Answers so many leases; false if there were not so many.
    bool Answer(int leases) {
        for (int i = 0; i < leases; ++i) {
            auto lease = queue.NextLease(worker, {});
            while (!lease && PlanNow(&queue, {})) {
                lease = queue.NextLease(worker, {});
            }
            if (!lease) {
                return false;
            }
            queue.AddResult(worker, lease->id, kJob, PseudoRender(lease->task), {});
        }
        return true;
    }
    std::shared_ptr<const Film> Finish() {
        Answer(1'000'000);
        const auto work = queue.TakeFilterWork();
        return work ? work->film : nullptr;
    }

    JobQueue queue;
    WorkerId worker = Worker();
};

using Tiles = std::map<std::size_t, std::string>;

SavedJob Saved(const Checkpoint& made, const Tiles& tiles) {
    SavedJob saved;
    saved.info = made.info;
    saved.checkpoint = DecodeCheckpoint(EncodeCheckpoint(made));
    saved.film = std::make_shared<Film>(made.window, made.display_width, made.display_height);
    const auto rects = CutIntoTiles(made.window, made.tile_size);
    for (const auto& [tile, bytes] : tiles) {
        saved.film->LoadTile(rects[tile], bytes);
    }
    return saved;
}

TEST(FilmCopy, WhatWasPlannedBeforeItBeganIsMergedWithoutCopyingAhead) {
    Farm farm("uniform");  // passes of 4, 4, 8, 16, 32; three are planned ahead
    ASSERT_TRUE(farm.Answer(1));
    PlanNow(&farm.queue, {});
    Tiles tiles;
    ASSERT_NE(
        farm.queue.BeginCopy(
            kJob, [&](std::size_t tile, std::string bytes) { tiles[tile] = std::move(bytes); }),
        nullptr);
    ASSERT_TRUE(farm.Answer(3 * 4 - 1));  // all of the three
    EXPECT_TRUE(tiles.empty());
    ASSERT_TRUE(farm.Answer(1));  // of a later one
    EXPECT_EQ(tiles.size(), 1u);
    ASSERT_TRUE(farm.Answer(1));
    EXPECT_EQ(tiles.size(), 2u);
    while (farm.queue.CopyTiles(kJob, 1)) {
    }
    EXPECT_EQ(tiles.size(), 4u);
    const auto made = farm.queue.TakeCopied(kJob);
    ASSERT_TRUE(made);
    EXPECT_EQ(made->info.samples_done, kWindow.area() * (4 + 4 + 8));
    EXPECT_FALSE(farm.queue.TakeCopied(kJob));
}

// At whatever moment a copy begins and however slowly it is made.
TEST(FilmCopy, AJobGoesOnFromItToTheSameBits) {
    for (const std::string sampler : {"uniform", "adaptive", "paper:mode=corrected"}) {
        Farm direct(sampler);
        const auto film = direct.Finish();
        ASSERT_NE(film, nullptr) << sampler;
        int copies = 0;
        for (const int before : {1, 3, 5, 9, 14}) {
            for (const int between : {0, 1, 3, 6}) {
                Farm farm(sampler);
                if (!farm.Answer(before)) {
                    continue;
                }
                Tiles tiles;
                if (farm.queue.BeginCopy(kJob, [&](std::size_t tile, std::string bytes) {
                        tiles[tile] = std::move(bytes);
                    }) == nullptr) {
                    continue;
                }
                for (bool more = true; more; more = farm.queue.CopyTiles(kJob, 1)) {
                    farm.Answer(between);
                }
                const auto made = farm.queue.TakeCopied(kJob);
                if (!made) {
                    continue;  // all samples came in meanwhile
                }
                ++copies;
                std::uint64_t merged = 0;
                for (const PassSummary& pass : made->info.passes) {
                    merged += pass.samples;
                }
                for (const OpenPassState& open : made->open) {
                    merged += open.merged_samples;
                }
                EXPECT_EQ(made->info.samples_done, merged);
                Farm again(Saved(*made, tiles), sampler);
                const auto continued = again.Finish();
                ASSERT_NE(continued, nullptr) << sampler << before << between;
                EXPECT_EQ(again.queue.Get(kJob).audit->problem, "");
                for (int c = 0; c < kFilmChannelCount; ++c) {
                    ASSERT_TRUE(std::ranges::equal(continued->Plane(c), film->Plane(c)))
                        << sampler << ", copied after " << before << " answers, " << between
                        << " between tiles";
                }
            }
        }
        EXPECT_GT(copies, 8) << sampler;
    }
}

}  // namespace
}  // namespace relume::jobs
