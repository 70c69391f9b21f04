#include "server/jobs/queue_status.h"

#include <algorithm>

#include "server/jobs/job_queue.h"

namespace relume::jobs {
namespace {

JobStatus StatusOf(const Job& job, TimePoint now) {
    const JobInfo& info = job.info();
    JobStatus status;
    status.name = info.name;
    status.state = info.state;
    status.paused = info.paused.has_value();
    status.samples = info.samples_done;
    status.active_pixels = job.active_pixels();
    if (!info.passes.empty()) {
        status.relmse = info.relmse;
    }
    status.image_relmse = info.image_relmse;
    if (info.eta) {
        status.eta_seconds = std::max(0.0, info.eta->seconds - ToSeconds(now - info.updated));
    }
    return status;
}

// Seconds of one thread for a sample; 0: not known.
double SampleSeconds(double busy_seconds, std::uint64_t samples) {
    return samples == 0 ? 0 : busy_seconds / static_cast<double>(samples);
}

}  // namespace

void JobTotals::Add(const JobInfo& job) {
    succeeded += job.state == JobState::kSucceeded ? 1 : 0;
    failed += job.state == JobState::kFailed ? 1 : 0;
    cancelled += job.state == JobState::kCancelled ? 1 : 0;
    samples += job.samples_done;
    bad_samples += job.bad_samples;
    rays += job.rays;
    leases_issued += job.leases_issued;
    leases_reissued += job.leases_reissued;
    results_duplicate += job.results_duplicate;
    busy_seconds += job.busy_seconds;
    plan_seconds += job.plan_seconds;
    merge_seconds += job.merge_seconds;
    if (job.outcome) {
        ++filtered;
        filter_seconds += job.outcome->seconds;
    }
    if (job.wait_seconds) {
        ++waited;
        wait_seconds += *job.wait_seconds;
    }
}

QueueStatus JobQueue::Status(TimePoint now, std::size_t max_jobs, std::size_t max_workers) const {
    QueueStatus status;
    status.totals = forgotten_;
    status.results_wrong = results_wrong_;
    status.checks = checks_.counts;
    for (const auto& [number, job] : by_number_) {
        status.totals.Add(job->info());
    }
    const double mean = SampleSeconds(status.totals.busy_seconds, status.totals.samples);
    for (const auto& [number, job] : by_number_) {
        const JobInfo& info = job->info();
        if (IsOver(info.state)) {
            continue;
        }
        ++(info.paused                          ? status.paused
           : info.state == JobState::kQueued    ? status.queued
           : info.state == JobState::kRendering ? status.rendering
                                                : status.filtering);
        if (info.state != JobState::kQueued && status.under_way.size() < max_jobs) {
            status.under_way.push_back(StatusOf(*job, now));
            status.under_way.back().share = job->running() ? share_.Share(number, now) : 0;
        } else if (info.state != JobState::kQueued) {
            ++status.under_way_left_out;
        }
        if (info.paused) {
            continue;
        }
        if (!info.wait_seconds) {
            status.oldest_wait_seconds =
                std::max(status.oldest_wait_seconds, ToSeconds(now - info.created));
        }
        status.units_waiting += job->units_waiting();
        status.active_pixels += job->active_pixels();

        const double own = SampleSeconds(info.busy_seconds, info.samples_done);
        const double seconds = own > 0 ? own : mean;
        std::optional<double> left = job->SamplesLeft(now);
        if (left && (seconds > 0 || *left == 0)) {
            *left *= seconds;
            status.core_seconds_left += *left;
        } else {
            left.reset();
            ++status.unpredicted;
        }
        if (!status.under_way.empty() && status.under_way.back().name == info.name) {
            status.under_way.back().core_seconds_left = left;
        }
    }
    for (const auto& [id, lease] : leases_) {
        ++(lease.abandoned ? status.leases_abandoned
           : lease.late    ? status.leases_late
                           : status.leases_lent);
    }
    for (const auto& [id, worker] : workers_) {
        ++(worker.silent                      ? status.workers_silent
           : !worker.info.quarantined.empty() ? status.workers_quarantined
                                              : status.workers_responding);
        status.threads += static_cast<std::uint64_t>(worker.info.threads);
        if (status.workers.size() < max_workers) {
            status.workers.push_back(worker.info);
            status.workers.back().leases_held = worker.leases.size();
            status.workers.back().seconds_since_report = ToSeconds(now - worker.last_heard);
        }
    }
    return status;
}

}  // namespace relume::jobs
