#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "server/jobs/error_curve.h"

namespace relume::jobs {

// What ends a job's sampling, and how large its passes may be: pure functions of numbers.

// Samples of a pixel whose count a float32 plane still tells exactly.
inline constexpr std::uint32_t kMaxPixelSamples = 1u << 24;
// Most samples of a pixel where neither a budget nor a time limit bounds them.
inline constexpr std::uint32_t kDefaultMaxSpp = 16384;

// Whatever is met first ends the sampling. A sampler may end it before.
struct Budgets {
    std::optional<std::uint64_t> samples;  // of the whole window
    std::uint32_t min_spp = 0;             // each pixel gets as many in the first pass
    std::optional<std::uint32_t> max_spp;  // no pixel gets more; unset: PixelCap's default
    std::optional<double> target;          // estimated RelMSE of the image that is returned
    std::optional<double> seconds;         // from the making of the job to its result
};

// "6400 samples, target 0.01, 20 s", for people.
std::string Describe(const Budgets& budgets);

// Most samples that a pixel may have.
std::uint32_t PixelCap(const Budgets& budgets);

enum class StopReason { kSamples, kTarget, kTimeLimit, kMaxSpp, kSampler, kCancelled };

// Why a job stopped, also in words.
struct Stop {
    StopReason reason;
    std::string words;
};

// Where a job is when a pass is planned.
struct BudgetState {
    std::uint64_t pixels = 0;
    std::uint64_t planned = 0;           // samples of all passes so far
    std::uint64_t done = 0;              // of these, rendered
    double samples_per_second = 0;       // of the whole farm; 0: not measured yet
    double seconds = 0;                  // since the job was made
    double plan_seconds = 0;             // expected until the pass can begin
    double finish_seconds = 0;           // predicted, from the last sample to the result
    std::span<const ErrorPoint> errors;  // estimated; the last one is of all that is planned
    bool filtered = false;
};

// The next pass may hold so many samples, above 0 unless it is a stop.
struct Allowance {
    std::uint64_t samples = 0;
    std::optional<Stop> stop;
};

// Samples and time alone: what can be said without an estimate of the error.
Allowance AllowedBySamples(const Budgets& budgets, const BudgetState& state);
Allowance AllowedByTime(const Budgets& budgets, const BudgetState& state);
// Aims a little below the target, and takes no more than it takes, however the error falls.
Allowance AllowedByTarget(const Budgets& budgets, const BudgetState& state);
// The least of the three; a stop of any is one.
Allowance NextAllowance(const Budgets& budgets, const BudgetState& state);

// That every pixel which wants more samples has as many as it may have.
Stop CapStop(const Budgets& budgets);

}  // namespace relume::jobs
