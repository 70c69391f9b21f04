#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/film/film.h"
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
    std::uint32_t pass = 0;    // from 0
    std::uint64_t budget = 0;  // samples left
    std::shared_ptr<Planner> planner;
    Guide guide;                                                // may be empty
    std::shared_ptr<const Film> film;                           // null: of the first pass
    std::shared_ptr<const std::vector<std::uint32_t>> planned;  // of each pixel; null with film
};

// What came of it.
struct PlanResult {
    std::shared_ptr<Film> film;  // of the first pass: a black one
    std::shared_ptr<Pass> pass;  // null: no more passes, for `reason`
    std::string reason;
    std::shared_ptr<const std::vector<std::uint32_t>> planned;  // with this pass
    std::vector<float> selector;                                // as in Plan
    std::vector<Decision> decisions;
    std::string failure;  // not empty: why the job has failed, for people
    double seconds = 0;   // that it took
};

// Plans the pass and cuts it into units. Failures of the planner are in the result.
PlanResult RunPlan(const PlanWork& work);

}  // namespace relume::jobs
