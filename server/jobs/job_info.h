#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "server/jobs/budget.h"
#include "server/jobs/forecast.h"

namespace relume::jobs {

enum class JobState { kQueued, kRendering, kFiltering, kSucceeded, kFailed, kCancelled };

inline bool IsOver(JobState state) {
    return state == JobState::kSucceeded || state == JobState::kFailed ||
           state == JobState::kCancelled;
}

struct PassSummary {
    std::uint32_t index = 0;
    std::uint64_t samples = 0;
    std::uint64_t active_pixels = 0;
    double relmse = 0;        // estimate for the unfiltered image after the pass
    double seconds = 0;       // from the end of the pass before, or the first lease, to its own
    double plan_seconds = 0;  // to plan it, while workers went on
    // Of the image that is returned: estimated when the next pass was planned, and what that was
    // expected to be when this one was.
    std::optional<double> image_relmse, relmse_predicted;
    std::uint64_t ranges = 0;  // units of tile and layer, each merged once
};

inline std::uint64_t TotalSamples(const std::vector<PassSummary>& passes) {
    std::uint64_t samples = 0;
    for (const PassSummary& pass : passes) {
        samples += pass.samples;
    }
    return samples;
}

// Whether every sample that a job asked for is in its film once: what the passes planned against
// what was taken in and what the film's pixels count.
struct LedgerAudit {
    std::uint64_t ranges = 0, samples = 0;  // of all passes
    std::uint64_t film_samples = 0;         // bad ones included
    std::string problem;                    // "": clean
};

struct WorkerShare {
    std::uint64_t samples = 0;
    std::uint64_t leases = 0;
    double busy_seconds = 0;  // thread time
};

// RelMSE (epsilon 0.01) estimated without a reference, and its 95 % interval.
struct EstimatedError {
    double relmse = 0, low = 0, high = 0;
};

// What the filter stage made of the film.
// One filter that a choosing one tried on a part of the image.
struct FilterCandidate {
    std::string filter;
    double relmse = 0;                       // estimated, outliers cut off
    double above_best = 0, uncertainty = 0;  // over the best one's, and the standard error of that
    double seconds = 0;                      // expected for the image
};

struct Outcome {
    std::string filter;  // with all parameters
    double seconds = 0;
    std::optional<double> mse;  // estimated for the filtered image
    EstimatedError noisy;       // of the unfiltered image
    std::optional<EstimatedError> filtered;
    std::map<std::string, std::string> notes;
    std::vector<FilterCandidate> candidates;  // if it was chosen, cheapest first
    std::string reason, dropped;              // why it was; features that did not help
    std::string image_sha256;
    std::uint64_t result_size = 0;  // bytes of the file
};

// What is known of a job at one moment.
struct JobInfo {
    std::string name;
    std::uint64_t number = 0;  // rises with every job
    std::string owner;         // whose share of the farm it takes
    int priority = 0;
    JobState state = JobState::kQueued;
    std::optional<TimePoint> paused;  // since when, by a client
    std::string message;              // why it failed, or why sampling stopped
    std::uint64_t samples_done = 0;
    std::optional<std::uint64_t> samples_budget;
    double relmse = 0;
    std::uint64_t rays = 0, bad_samples = 0;
    std::vector<PassSummary> passes;             // that are wholly in the film
    std::optional<Outcome> outcome;              // once succeeded; if cancelled, of what there was
    std::map<std::string, WorkerShare> workers;  // by name
    std::uint64_t leases_issued = 0, leases_reissued = 0, results_duplicate = 0;
    TimePoint created;  // later than it really was by `down`
    std::optional<TimePoint> ended;
    Duration down{};   // time that does not count: no server, or the job was paused or over
    std::string held;  // why nothing goes on for now; "": it does
    std::optional<LedgerAudit> audit;    // once all samples are in
    std::uint32_t restarts = 0;          // of the server, while it was under way
    std::optional<double> wait_seconds;  // from its making to its first lease
    double busy_seconds = 0;             // thread time of all workers
    double render_seconds = 0;           // first lease to last result
    double plan_seconds = 0;             // of all plans
    double plan_filter_seconds = 0;  // of these, in the filter: guides and estimates of the error
    double merge_seconds = 0;        // to read, check and merge all results
    double save_seconds = 0;         // thread time of the server, to save the film
    std::vector<std::string> notes;
    std::optional<StopReason> stop;
    std::optional<double> image_relmse;   // of the last plan
    std::vector<ForecastPoint> forecast;  // after it
    std::optional<Eta> eta;               // from `updated` on
    std::optional<Eta> predicted;         // from `created` on, after the first estimate
    double finish_seconds_predicted = 0;
    TimePoint updated;          // when this was published
    std::string numeric_class;  // of the workers that may work on it; "" = none has yet

    // Time that it has had since it was made, but for `down`.
    Duration Used(TimePoint now) const {
        return (ended ? *ended : paused ? std::min(*paused, now) : now) - created;
    }
};

struct JobEvent {
    std::uint64_t number = 0;  // from 1, rising by one
    std::shared_ptr<const JobInfo> job;
};

struct WorkerInfo {
    std::string name;
    std::string numeric_class;
    int threads = 1;
    std::size_t leases_held = 0;
    std::uint64_t samples_done = 0;
    double samples_per_second = 0;  // all threads; 0 = not measured yet
    double seconds_since_report = 0;
    std::string quarantined;  // why it gets no leases; "": it gets some
    TimePoint quarantined_since{};
    bool away = false;  // in quarantine, and not connected
};

// Units whose answer was compared with another worker's before it was merged.
struct CheckCounts {
    std::uint64_t equal = 0;
    std::uint64_t odd = 0;    // answers that two others are against, or their own worker
    std::uint64_t alone = 0;  // chosen, and no second worker was there
};

}  // namespace relume::jobs
