#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/jobs/job_queue.h"
#include "tests/unit/jobs/plan_now.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {

// Many jobs on workers of one thread, in virtual time: nothing but rendering takes any.
class SharedFarm {
  public:
    // Samples/s of each worker.
    explicit SharedFarm(const std::vector<double>& speeds) {
        for (const double speed : speeds) {
            Worker& worker = workers_.emplace_back();
            worker.id = queue.AddWorker("w", "class", 1, At());
            worker.speed = speed;
            queue.SetCredits(worker.id, 2, 0);
        }
    }

    // 64x64 pixels in units of 8x8, at `spp`; each sample costs `cost` times what others do.
    void AddJob(const std::string& name, const std::string& owner, int priority = 0,
                double cost = 1, std::uint64_t spp = 1 << 16) {
        queue.AddJob(name, Setup(owner, priority, spp), At());
        costs_[name] = cost;
    }
    static JobSetup Setup(const std::string& owner, int priority, std::uint64_t spp,
                          const std::string& sampler = "uniform") {
        JobSetup setup;
        setup.owner = owner;
        setup.priority = priority;
        setup.window = {0, 0, 64, 64};
        setup.display_width = setup.display_height = 64;
        setup.tile_size = 8;
        setup.budgets.samples = spp * 64 * 64;
        setup.planner = MakePlanner(sampler);
        return setup;
    }

    // Until so many seconds have passed in all, or nothing happens any more.
    void RunUntil(double seconds) {
        for (;;) {
            GiveOut();
            for (auto work = queue.TakeFilterWork(); work; work = queue.TakeFilterWork()) {
                films[work->name] = work->film;
            }
            double next = next_tick_;
            for (const Worker& worker : workers_) {
                next = std::min(next, worker.ends);
            }
            if (next > seconds) {
                now = seconds;
                return;
            }
            now = next;
            if (now == next_tick_) {
                for (const Worker& worker : workers_) {
                    queue.Heard(worker.id, At());
                }
                queue.Tick(At());
                next_tick_ += 0.1;
                continue;
            }
            Answer(&*std::ranges::min_element(workers_, {}, &Worker::ends));
        }
    }
    // Leases that workers hold of the job.
    std::size_t Held(const std::string& job) const {
        std::size_t held = 0;
        for (const Worker& worker : workers_) {
            held +=
                static_cast<std::size_t>(std::ranges::count(worker.held, job, &LeaseGrant::job));
        }
        return held;
    }
    TimePoint At() const { return TimePoint{} + FromSeconds(now); }

    JobQueue queue;
    double now = 0;                      // seconds
    std::map<std::string, double> used;  // core-seconds of merged answers, by job
    std::vector<std::string> lent;       // jobs of all leases, in order
    std::size_t changes = 0;             // from one job to another, of a worker
    std::map<std::string, std::shared_ptr<const Film>> films;  // of jobs that came to their filter

  private:
    static constexpr double kNever = std::numeric_limits<double>::infinity();
    struct Worker {
        WorkerId id = 0;
        double speed = 0;
        std::deque<LeaseGrant> held;  // the first is being rendered
        double started = 0, ends = kNever;
        std::string last;  // job that it was lent
    };

    void Begin(Worker* worker) {
        worker->started = now;
        worker->ends = kNever;
        if (!worker->held.empty()) {
            const LeaseGrant& lease = worker->held.front();
            worker->ends = now + costs_.at(lease.job) *
                                     static_cast<double>(lease.task.TotalSamples()) / worker->speed;
        }
    }
    void GiveOut() {
        for (Worker& worker : workers_) {
            for (const LeaseId revoked : queue.TakeRevoked(worker.id)) {
                const bool running = !worker.held.empty() && worker.held.front().id == revoked;
                std::erase_if(worker.held, [&](const auto& l) { return l.id == revoked; });
                if (running) {
                    Begin(&worker);
                }
            }
            for (;;) {
                auto lease = queue.NextLease(worker.id, At());
                if (!lease && PlanNow(&queue, At())) {
                    continue;
                }
                if (!lease) {
                    break;
                }
                if (known_.insert({worker.id, lease->job}).second) {
                    queue.SceneReady(worker.id, lease->job, {}, At());
                }
                lent.push_back(lease->job);
                changes += worker.last == lease->job ? 0 : 1;
                worker.last = lease->job;
                worker.held.push_back(std::move(*lease));
                if (worker.held.size() == 1) {
                    Begin(&worker);
                }
            }
        }
    }
    void Answer(Worker* worker) {
        const LeaseGrant lease = std::move(worker->held.front());
        worker->held.pop_front();
        TileResult result = PseudoRender(lease.task);
        result.seconds = now - worker->started;
        if (queue.AddResult(worker->id, lease.id, lease.job, std::move(result), At()) ==
            ResultVerdict::kMerged) {
            used[lease.job] += now - worker->started;
        }
        Begin(worker);
    }

    std::vector<Worker> workers_;
    std::map<std::string, double> costs_;
    std::set<std::pair<WorkerId, std::string>> known_;
    double next_tick_ = 0;
};

}  // namespace relume::jobs
