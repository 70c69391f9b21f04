#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/param_set.h"
#include "core/film/film.h"

namespace relume::jobs {

// What became of a pixel.
enum class Decision : std::uint8_t {
    kConverged,  // gets no more samples: its error is small enough
    kSampled,    // samples still pay
    kCapped,     // they would, but it has as many as a pixel may have
};

// One pass: how many more samples each pixel gets. All row-major over the film's window.
struct Plan {
    std::vector<std::uint32_t> counts;  // empty: no more passes
    std::string reason;                 // why there are no more, for people
    std::vector<float> selector;        // the number that decided, a pixel; empty: there is none
    std::vector<Decision> decisions;    // empty, or as selector
};

// What a filter says of where `samples` more should go, a pixel, row-major: one of
// - where they change the filtered image most, an estimate of its variance relative to its
//   brightness: (F_a - F_b)^2 / (F^2 + 1e-3), mean over RGB, of the two halves filtered apart;
// - for a planner that has a Method: the counts that this filter's own plan expects, `samples` in
//   all.
// A pure function of film and number; thread-safe.
using Guide = std::function<std::vector<float>(const Film&, double samples)>;

// What a plan is made from.
struct PlanInput {
    const Film& film;      // the samples that may be looked at
    std::uint64_t budget;  // the counts may sum to no more
    // Samples of each pixel that are planned so far, in the film or still to come; empty: those in
    // the film.
    std::span<const std::uint32_t> planned = {};
    const Guide* guide = nullptr;  // null: the image is not filtered
    double rays = 0;               // traced for a sample in the film, mean; 0: not known
};

// Samples of each pixel that are planned so far.
std::vector<std::uint32_t> PlannedCounts(const PlanInput& input);

inline constexpr const char* kBudgetSpent = "sample budget spent";

// What the film holds when a planner looks at it. Workers never wait for a plan but with kWhole.
enum class FilmView {
    kNothing,  // any part of what is planned: only its size may be looked at, not its samples
    kLagging,  // all passes, but of the last one without what cover.h keeps back
    kWhole,    // all passes: workers have nothing to do while the last leases of one are awaited
};

// Decides where samples go ("sampler" on the command line). One object serves one job: it may keep
// state from pass to pass. Its plans are pure functions of the films it was shown. Not thread-safe.
class Planner {
  public:
    virtual ~Planner() = default;
    // Name with all parameters, "paper:mode=corrected,...".
    virtual std::string Describe() const = 0;
    virtual FilmView View() const = 0;
    // The filter whose own plan this is, whatever filters the image; null: none.
    virtual const char* Method() const { return nullptr; }
    // The next pass, called once a pass, on any thread.
    virtual Plan NextPass(const PlanInput& input) = 0;
    // What it keeps from pass to pass, as bytes; Restore makes another one, of the same
    // description, go on with the same plans. Bytes that are not Save's throw kDataLoss.
    virtual std::string Save() const = 0;
    virtual void Restore(std::string_view bytes) = 0;
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
