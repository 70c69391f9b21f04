#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/jobs/error_curve.h"
#include "server/jobs/job_info.h"
#include "server/jobs/pass.h"
#include "server/jobs/planner.h"

namespace relume::jobs {

// One pass of a checkpoint that is not wholly in the film.
struct OpenPassState {
    std::shared_ptr<const PassPlan> plan;
    std::vector<std::uint32_t> merged;  // layers in the film, by tile
    std::vector<double> error;          // Pass::TileError, by tile
    double plan_seconds = 0;
    std::optional<double> image_relmse, relmse_predicted;  // as in PassSummary
    // For the ledger alone, not in the bytes: of the whole pass, and of what is merged.
    std::uint64_t samples = 0, ranges = 0, merged_samples = 0;
};

// All that a job is at one moment between plans, but for its film: with that, and for each tile the
// layers that it had merged (FilmCopy), a job goes on to the same bits. Results that are not in the
// film are left out, and not counted in `info`: their units are to be rendered again. What is large
// is shared, and does not change.
struct Checkpoint {
    JobInfo info;
    std::vector<OpenPassState> open;  // oldest first
    std::uint32_t passes_planned = 0;
    std::uint64_t units_planned = 0, samples_planned = 0;
    std::optional<Stop> stop;
    std::vector<ErrorPoint> errors;
    std::vector<double> tile_error;
    std::string planner;                                        // BudgetedPlanner::Save
    std::shared_ptr<const std::vector<std::uint32_t>> planned;  // samples of each pixel
    std::shared_ptr<const std::vector<float>> selector;
    std::shared_ptr<const std::vector<Decision>> decisions;
    TileRect window;
    int display_width = 0, display_height = 0;
    int tile_size = 32;
};

// All but `info`, as bytes for the same build. Decode throws kDataLoss for others.
std::string EncodeCheckpoint(const Checkpoint& checkpoint);
Checkpoint DecodeCheckpoint(std::string_view bytes);

}  // namespace relume::jobs
