#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/film/film.h"
#include "server/jobs/budgeted_planner.h"
#include "server/jobs/pass.h"
#include "server/jobs/planner.h"

namespace relume::jobs {

// The planning of one job's next pass: what JobQueue hands out to be done elsewhere, for it takes
// long. Nothing that a planner may look at changes meanwhile.
struct PlanWork {
    std::string name;  // of the job
    TileRect window;
    int display_width = 0, display_height = 0;
    int tile_size = 32;
    std::uint32_t pass = 0;  // from 0
    std::shared_ptr<BudgetedPlanner> planner;
    std::uint64_t samples_done = 0;    // when the work was handed out, as the next two
    double samples_per_second = 0;     // 0: not known
    double seconds = 0;                // since the job was made
    Guide guide;                       // may be empty
    double rays = 0;                   // as in PlanInput
    std::shared_ptr<const Film> film;  // null: of the first pass
    std::shared_ptr<const std::vector<std::uint32_t>> planned;  // of each pixel; null with film
};

// What came of it.
struct PlanResult {
    std::shared_ptr<Film> film;       // of the first pass: a black one
    std::shared_ptr<Pass> pass;       // null: no more passes
    std::optional<Stop> stop;         // why there are none
    bool last = false;                // nor will there be after this one: the samples are spent
    std::optional<ErrorPoint> error;  // as in BudgetedPlanner::Pass, as the next two
    std::optional<double> expected_error;
    double finish_seconds = 0;
    std::shared_ptr<const std::vector<std::uint32_t>> planned;  // with this pass
    std::vector<float> selector;                                // as in Plan
    std::vector<Decision> decisions;
    std::string failure;        // not empty: why the job has failed, for people
    double seconds = 0;         // that it took
    double filter_seconds = 0;  // of these, as in BudgetedPlanner::Pass
};

// Plans the pass and cuts it into units. Failures of the planner are in the result.
PlanResult RunPlan(const PlanWork& work);

}  // namespace relume::jobs
