#pragma once

#include <functional>
#include <string>

#include "server/jobs/budgeted_planner.h"
#include "server/jobs/planner.h"

namespace relume::server {

// The filter in the sampler's loop: where the two filtered halves of a film disagree
// (denoise/halves.h). `filter` is a job's: an empty Guide for "none", for all others that of the
// bilateral filter, which ranks regions alike and is the cheapest.
// Halves of the size are filtered: a quarter of the time, and no worse a guide (bench/sampling).
jobs::Guide MakeGuide(const std::string& filter);

// The plan of a filter that has one of its own, by name: a planner's Method.
jobs::Guide MakeMethodGuide(const std::string& filter);

// Estimated RelMSE of a job's image if it were finished now (denoise/error_estimate.h); of the
// unfiltered image if the filter has no estimate. Serves one job, whose film it is shown as it
// grows: a filter that chooses does so anew only when the samples have doubled.
// What is set is `error`, `save` and `restore`.
jobs::Estimators MakeErrorEstimator(const std::string& filter);

}  // namespace relume::server
