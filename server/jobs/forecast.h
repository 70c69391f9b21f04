#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/jobs/budget.h"
#include "server/jobs/error_curve.h"
#include "server/jobs/speed_meter.h"

namespace relume::jobs {

// What is to be expected of a job that runs: pure functions of numbers. They decide nothing.

struct ForecastInput {
    Budgets budgets;
    std::uint64_t pixels = 0;
    std::uint64_t done = 0;  // samples that are rendered
    double seconds = 0;      // since the job was made
    SpeedMeter::Speed speed;
    double finish_seconds = 0;           // predicted, from the last sample to the result
    std::span<const ErrorPoint> errors;  // estimated so far
    bool filtered = false;
};

// The image with so many samples: when it would be there, and its error.
struct ForecastPoint {
    std::uint64_t samples = 0;
    double seconds = 0;  // since the job was made, the finish included
    double relmse = 0;
};

// From the newest estimate on, by doublings up to where the budgets end, that included, or to 64
// times. Empty before there is an estimate or a speed.
std::vector<ForecastPoint> Forecast(const ForecastInput& input);

// Samples that are still to be rendered, as far as is known now. Nothing as long as no budget
// tells.
std::optional<double> SamplesLeft(const ForecastInput& input);

// Seconds from now to the result. The interval comes from the speeds measured and from how well the
// errors so far lie on one curve.
struct Eta {
    double seconds = 0, low = 0, high = 0;
};
// Nothing as long as no budget tells. A sampler that stops by itself may be sooner.
std::optional<Eta> EstimateEta(const ForecastInput& input);

}  // namespace relume::jobs
