#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/jobs/job_queue.h"
#include "tests/unit/jobs/plan_now.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {

// A queue, small jobs and workers that answer when they are told to.
class JobQueueTest : public testing::Test {
  protected:
    // Tiles of 16 on 48x16 pixels: three units in the pilot.
    void AddJob(const std::string& name, std::uint64_t budget = 48 * 16 * 4,
                std::uint64_t memory = 0) {
        JobSetup setup;
        setup.memory = memory;
        setup.owner = name;
        setup.window = {0, 0, 48, 16};
        setup.display_width = 48;
        setup.display_height = 16;
        setup.tile_size = 16;
        setup.budgets.samples = budget;
        setup.planner = MakePlanner("uniform");
        queue.AddJob(name, std::move(setup), now);
    }
    WorkerId AddWorker(std::uint32_t credits, const std::string& numeric_class = "avx2") {
        const WorkerId id = queue.AddWorker("w", numeric_class, 1, now);
        queue.SetCredits(id, credits, 0);
        return id;
    }
    // Plans whatever is to be planned at once.
    std::optional<LeaseGrant> NextLease(WorkerId id) {
        auto lease = queue.NextLease(id, now);
        return lease || !PlanNow(&queue, now) ? lease : NextLease(id);
    }
    std::vector<LeaseGrant> TakeAll(WorkerId id) {
        std::vector<LeaseGrant> leases;
        while (auto lease = NextLease(id)) {
            leases.push_back(std::move(*lease));
        }
        return leases;
    }
    ResultVerdict Deliver(WorkerId id, const LeaseGrant& lease) {
        return queue.AddResult(id, lease.id, lease.job, PseudoRender(lease.task), now);
    }
    void Advance(double seconds) { now += FromSeconds(seconds); }

    JobQueue queue;
    TimePoint now{};
};

}  // namespace relume::jobs
