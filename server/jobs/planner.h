#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/base/param_set.h"
#include "core/film/film.h"

namespace relume::jobs {

// One pass: how many more samples each pixel gets.
struct Plan {
    std::vector<std::uint32_t> counts;  // row-major over the film's window; empty: no more passes
    std::string reason;                 // why there are no more, for people
};

inline constexpr const char* kBudgetSpent = "sample budget spent";

// Decides where samples go ("sampler" on the command line). One object serves one job: it may keep
// state from pass to pass. Its plans are pure functions of the films it was shown. Not thread-safe.
class Planner {
  public:
    virtual ~Planner() = default;
    // Name with all parameters, "paper:mode=corrected,...".
    virtual std::string Describe() const = 0;
    // The next pass, called once a pass when all samples of the earlier ones are merged. `budget`
    // samples may still be spent; the counts never sum to more.
    virtual Plan NextPass(const Film& film, std::uint64_t budget) = 0;
};

// "uniform", "paper:mode=printed"; an unknown name or parameter throws kInvalidArgument with the
// known ones.
std::unique_ptr<Planner> MakePlanner(const std::string& text);

// The parameter `pilot` of a planner, samples a pixel in the first pass: even and `least` to 4096.
// Throws kInvalidArgument naming `sampler`.
int ReadPilot(const ParamSet& params, const char* sampler, int otherwise, int least);

// Text for people: every planner, and its parameters with defaults.
std::string DescribePlanners();

}  // namespace relume::jobs
