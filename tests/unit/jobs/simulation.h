#pragma once

#include <algorithm>
#include <deque>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "server/jobs/job_queue.h"
#include "tests/unit/jobs/plan_now.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {

// How a simulated farm misbehaves. Chances are per lease.
struct FarmHabits {
    int workers = 2;
    double lose = 0;       // never answered
    double twice = 0;      // answered twice
    double leave = 0;      // the worker goes, a new one comes
    double hand_back = 0;  // returned unrendered
    double wrong = 0;      // answered wrongly
    double slow = 0;       // answered only after the deadline
    double copy = 0;       // a copy of job and film is begun
    double kill = 0;       // the server is gone, and goes on from the last whole copy
};

// A job's copies as a server would keep them: the last whole one, and one that is being made.
class SimulatedDisk {
  public:
    void Begin(JobQueue* queue) {
        auto tiles = std::make_shared<std::map<std::size_t, std::string>>();
        if (queue->BeginCopy("jobs/a", [tiles](std::size_t tile, std::string bytes) {
                if (!tiles->emplace(tile, std::move(bytes)).second) {
                    throw Error(ErrorCode::kInternal, "a tile came twice");
                }
            }) != nullptr) {
            making_ = Copy{{}, {}, tiles};
        }
    }
    void GoOn(JobQueue* queue) {
        if (!making_ || queue->CopyTiles("jobs/a", 1)) {
            return;
        }
        if (const auto checkpoint = queue->TakeCopied("jobs/a")) {
            making_->info = checkpoint->info;
            making_->checkpoint = EncodeCheckpoint(*checkpoint);
            whole_ = std::move(making_);
        }
        making_.reset();
    }
    // What a server that starts again knows.
    SavedJob Load(const JobInfo& now, std::uint64_t last_event) {
        making_.reset();
        SavedJob saved{whole_ ? whole_->info : now, last_event, {}, {}};
        if (whole_) {
            saved.checkpoint = DecodeCheckpoint(whole_->checkpoint);
            const Checkpoint& c = *saved.checkpoint;
            saved.film = std::make_shared<Film>(c.window, c.display_width, c.display_height);
            const auto rects = CutIntoTiles(c.window, c.tile_size);
            if (whole_->tiles->size() != rects.size()) {
                throw Error(ErrorCode::kInternal, "a copy lacks tiles");
            }
            for (const auto& [tile, bytes] : *whole_->tiles) {
                saved.film->LoadTile(rects[tile], bytes);
            }
        }
        return saved;
    }

  private:
    struct Copy {
        JobInfo info;
        std::string checkpoint;
        std::shared_ptr<std::map<std::size_t, std::string>> tiles;
    };
    std::optional<Copy> whole_, making_;
};

struct FarmRun {
    JobInfo info;
    std::shared_ptr<const Film> film;
};

// Renders a job on simulated workers with simulated time.
inline FarmRun RunFarm(const std::string& sampler, const TileRect& window, int tile_size,
                       std::uint64_t budget, const FarmHabits& habits, std::uint32_t seed) {
    struct Held {
        LeaseGrant lease;
        TimePoint ready;
    };
    auto queue_now = std::make_unique<JobQueue>();
    SimulatedDisk disk;
    TimePoint now{};
    std::mt19937 random(seed);
    const auto chance = [&](double p) { return std::uniform_real_distribution<>()(random) < p; };
    const auto make_setup = [&] {
        JobSetup setup;
        setup.window = window;
        setup.display_width = window.x1;
        setup.display_height = window.y1;
        setup.tile_size = tile_size;
        setup.budgets.samples = budget;
        setup.planner = MakePlanner(sampler);
        return setup;
    };
    queue_now->AddJob("jobs/a", make_setup(), now);

    std::map<WorkerId, std::vector<Held>> workers;
    const auto add_worker = [&] {
        JobQueue& queue = *queue_now;
        const WorkerId id = queue.AddWorker("w", "class", 1, now);
        queue.SetCredits(id, 3, 0);
        workers[id];
    };
    for (int i = 0; i < habits.workers; ++i) {
        add_worker();
    }
    const auto deliver = [&](WorkerId id, const LeaseGrant& lease) {
        JobQueue& queue = *queue_now;
        TileResult result = PseudoRender(lease.task);
        if (chance(habits.wrong)) {
            result.planes[0] += 1;
        }
        queue.AddResult(id, lease.id, lease.job, result, now);
        if (chance(habits.twice)) {
            queue.AddResult(id, lease.id, lease.job, result, now);
        }
    };
    for (int step = 0; step < 200'000 && !IsOver(queue_now->Get("jobs/a").state); ++step) {
        now += FromSeconds(0.05);
        if (chance(habits.kill)) {
            SavedJob saved =
                disk.Load(queue_now->Get("jobs/a"), queue_now->LastEvent("jobs/a") + 100);
            queue_now = std::make_unique<JobQueue>();
            queue_now->RestoreJob(std::move(saved), make_setup(), now);
            workers.clear();
            for (int i = 0; i < habits.workers; ++i) {
                add_worker();
            }
        }
        JobQueue& queue = *queue_now;
        if (chance(habits.copy)) {
            disk.Begin(&queue);
        }
        disk.GoOn(&queue);
        std::vector<WorkerId> ids;
        for (const auto& [id, held] : workers) {
            ids.push_back(id);
        }
        const WorkerId id = ids[random() % ids.size()];
        for (const WorkerId w : ids) {
            queue.Heard(w, now);
            queue.SceneReady(w, "jobs/a", {}, now);
        }
        queue.Tick(now);
        if (chance(0.2)) {  // plans take their time
            PlanNow(&queue, now);
        }
        while (auto lease = queue.NextLease(id, now)) {
            if (!chance(habits.lose)) {
                const double wait = chance(habits.slow) ? lease->deadline_seconds * 1.5 : 0;
                workers[id].push_back({std::move(*lease), now + FromSeconds(wait)});
            }
        }
        if (chance(habits.leave)) {
            queue.RemoveWorker(id);
            workers.erase(id);
            add_worker();
            continue;
        }
        auto& held = workers[id];
        std::shuffle(held.begin(), held.end(), random);
        if (!held.empty() && held.back().ready <= now) {
            const LeaseGrant lease = std::move(held.back().lease);
            held.pop_back();
            if (chance(habits.hand_back)) {
                queue.ReturnLeases(id, {lease.id});
            } else {
                deliver(id, lease);
            }
        }
        if (auto work = queue.TakeFilterWork()) {
            return {queue.Get("jobs/a"), work->film};
        }
    }
    return {queue_now->Get("jobs/a"), nullptr};
}

}  // namespace relume::jobs
