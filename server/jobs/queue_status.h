#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/jobs/job_info.h"

namespace relume::jobs {

// Sums over jobs: what their reports say, together. Never falls as jobs go on.
struct JobTotals {
    std::uint64_t succeeded = 0, failed = 0, cancelled = 0;
    std::uint64_t samples = 0, bad_samples = 0, rays = 0;
    std::uint64_t leases_issued = 0, leases_reissued = 0, results_duplicate = 0;
    double busy_seconds = 0, plan_seconds = 0, merge_seconds = 0;
    std::uint64_t filtered = 0;  // jobs whose image is, and the time that took
    double filter_seconds = 0;
    std::uint64_t waited = 0;  // jobs that have had a lease, and the time until then
    double wait_seconds = 0;

    void Add(const JobInfo& job);
};

// One job that is rendering or filtering.
struct JobStatus {
    std::string name;
    JobState state = JobState::kRendering;
    std::uint64_t samples = 0, active_pixels = 0;
    std::optional<double> relmse;        // of the unfiltered image, after a pass
    std::optional<double> image_relmse;  // of the one that is returned
    std::optional<double> core_seconds_left;
    std::optional<double> eta_seconds;  // from now
    bool paused = false;
    double share = 0;  // as JobQueue::ShareOf
};

// Jobs, workers and leases at one moment, seen from outside.
struct QueueStatus {
    JobTotals totals;  // of all jobs, those forgotten included
    std::uint64_t results_wrong = 0;
    CheckCounts checks;
    std::uint64_t queued = 0, rendering = 0, filtering = 0;  // jobs, but for
    std::uint64_t paused = 0;        // those that are: nothing of them is in what waits or is left
    double oldest_wait_seconds = 0;  // of jobs that have had no lease, the longest so far
    std::uint64_t units_waiting = 0;
    std::uint64_t leases_lent = 0, leases_late = 0, leases_abandoned = 0;
    std::uint64_t active_pixels = 0;  // of all jobs
    // To render what is left of all jobs that can be told of, and how many can't. A job that has
    // not been measured takes as long for a sample as all jobs before it.
    double core_seconds_left = 0;
    std::uint64_t unpredicted = 0;
    std::uint64_t workers_responding = 0, workers_silent = 0, workers_quarantined = 0;
    std::uint64_t threads = 0;
    std::vector<JobStatus> under_way;  // oldest first, not more than asked for
    std::uint64_t under_way_left_out = 0;
    std::vector<WorkerInfo> workers;  // likewise
};

}  // namespace relume::jobs
