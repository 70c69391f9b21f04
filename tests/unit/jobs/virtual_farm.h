#pragma once

#include <algorithm>
#include <deque>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/jobs/job_queue.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {

// A farm in virtual time: nothing but rendering and planning takes any.
struct VirtualFarm {
    std::vector<double> speeds{1e5, 1e5, 4e5, 4e5};  // samples/s of each worker, of one thread
    std::uint32_t credits = 2;
    double plan_share = 0.02;  // time of a plan, of that of all samples before it
    int tile_size = 32;
    double kill_at = -1;  // seconds: the last worker is gone
};

struct VirtualRun {
    JobInfo info;
    std::shared_ptr<const Film> film;
    double seconds = 0;  // first lease to last result
    double busy = 0;     // share of it that workers spent on results that count
};

// Regions differ in cost, by a factor of up to three.
inline double CostOf(const TileTask& task) {
    const auto key = static_cast<std::uint64_t>(task.rect.x0 / 64 * 1000 + task.rect.y0 / 64);
    return (0.5 + static_cast<double>(Mix(key) >> 40) * 0x1p-24) *
           static_cast<double>(task.TotalSamples());
}

inline VirtualRun RunVirtually(std::shared_ptr<Planner> planner, const TileRect& window,
                               std::uint64_t budget, const VirtualFarm& farm) {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    struct Worker {
        WorkerId id = 0;
        double speed = 0;
        std::deque<LeaseGrant> held;  // the first is being rendered
        double started = 0, ends = kNever;
    };
    const std::string job = "jobs/a";
    JobQueue queue;
    JobSetup setup;
    setup.window = window;
    setup.display_width = window.x1;
    setup.display_height = window.y1;
    setup.tile_size = farm.tile_size;
    setup.budgets.samples = budget;
    setup.planner = std::move(planner);
    const TimePoint zero{};
    queue.AddJob(job, std::move(setup), zero);
    std::vector<Worker> workers;
    double all_speeds = 0;
    for (const double speed : farm.speeds) {
        workers.push_back({queue.AddWorker("w", "class", 1, zero), speed, {}, 0, kNever});
        queue.SetCredits(workers.back().id, farm.credits, 0);
        queue.SceneReady(workers.back().id, job, {}, zero);
        all_speeds += speed;
    }

    VirtualRun run;
    double now = 0, first_lease = -1, last_result = 0, useful = 0, present = 0, next_tick = 0;
    double kill_at = farm.kill_at < 0 ? kNever : farm.kill_at;
    std::optional<PlanWork> plan;
    double plan_ends = kNever;
    const auto at = [&] { return zero + FromSeconds(now); };
    const auto begin = [&](Worker& worker) {
        worker.started = now;
        worker.ends =
            worker.held.empty() ? kNever : now + CostOf(worker.held.front().task) / worker.speed;
    };
    for (;;) {
        for (Worker& worker : workers) {
            for (const LeaseId revoked : queue.TakeRevoked(worker.id)) {
                const bool running = !worker.held.empty() && worker.held.front().id == revoked;
                std::erase_if(worker.held, [&](const auto& l) { return l.id == revoked; });
                if (running) {
                    begin(worker);
                }
            }
            while (auto lease = queue.NextLease(worker.id, at())) {
                first_lease = first_lease < 0 ? now : first_lease;
                worker.held.push_back(std::move(*lease));
                if (worker.held.size() == 1) {
                    begin(worker);
                }
            }
        }
        if (auto work = queue.TakeFilterWork()) {
            run.film = work->film;
            break;
        }
        if (!plan) {
            plan = queue.TakePlanWork(at());
            if (plan) {
                std::uint64_t before = 0;
                if (plan->planned) {
                    before = std::accumulate(plan->planned->begin(), plan->planned->end(), before);
                }
                plan_ends = now + farm.plan_share * static_cast<double>(before) / all_speeds;
            }
        }
        double next = std::min({plan_ends, next_tick, kill_at});
        for (const Worker& worker : workers) {
            next = std::min(next, worker.ends);
        }
        if (next > 1e5) {
            break;  // nothing happens any more
        }
        present += first_lease < 0 ? 0 : (next - now) * static_cast<double>(workers.size());
        now = next;
        if (now == kill_at) {
            queue.RemoveWorker(workers.back().id);
            workers.pop_back();
            kill_at = kNever;
        } else if (now == next_tick) {
            for (const Worker& worker : workers) {
                queue.Heard(worker.id, at());
            }
            queue.Tick(at());
            next_tick += 0.1;
        } else if (now == plan_ends) {
            queue.Planned(job, RunPlan(*plan), at());
            plan.reset();
            plan_ends = kNever;
        } else {
            Worker& worker = *std::ranges::min_element(workers, {}, &Worker::ends);
            const LeaseGrant lease = std::move(worker.held.front());
            worker.held.pop_front();
            TileResult result = PseudoRender(lease.task);
            result.seconds = now - worker.started;
            if (queue.AddResult(worker.id, lease.id, job, std::move(result), at()) ==
                ResultVerdict::kMerged) {
                useful += now - worker.started;
                last_result = now;
            }
            begin(worker);
        }
    }
    run.info = queue.Get(job);
    run.seconds = last_result - first_lease;
    run.busy = useful / present;
    return run;
}

}  // namespace relume::jobs
