#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/cancel_token.h"
#include "core/base/param_set.h"
#include "core/film/tile.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// What a method can't work without; the registry refuses by name if the frame lacks it.
struct Needs {
    bool halves = false;
    bool samples = false;       // the samples themselves (Frame::samples)
    std::vector<int> features;  // FeatureChannel
    int min_spp = 1;
};

struct Result {
    Plane color[3];
    std::optional<Plane>
        error;  // estimated squared error of `color` a pixel, mean over RGB; may be negative
    // Derivative of a filtered pixel by its own noisy value, a channel: what SURE needs
    // (error_estimate.h). Unset: not known.
    std::optional<std::array<Plane, 3>> derivative;
    std::map<std::string, std::string> notes;  // what was chosen, for the report
};

class Denoiser;
struct ErrorEstimate;  // error_estimate.h

// Estimated RelMSE in a window of a frame: filtered, and not.
struct WindowError {
    TileRect window;
    double relmse, unfiltered;
};

// What a method that chooses among others has taken for a frame, and why.
struct Choice {
    std::shared_ptr<const Denoiser> denoiser;
    struct Candidate {
        std::string filter;
        double relmse;                   // estimated on a part of the frame, without outliers
        double above_best, uncertainty;  // of that: over the best one's, and its standard error
        double seconds;                  // expected for the frame
    };
    std::vector<Candidate> candidates;  // cheapest first
    std::string reason;                 // for people
    std::string dropped;                // features that were of no use, for people
    // For estimates of its error (error_estimate.h): over that of `base` where both were tried, and
    // the standard error of that.
    std::shared_ptr<const Denoiser> base;             // null: nothing was tried
    std::shared_ptr<const ErrorEstimate> base_error;  // of the frame, if it was tried whole
    std::vector<WindowError> base_windows;            // of parts of it that were tried
    double over_base = 1, over_base_error = 0;
};

// One filtering method with its parameters. Reconstruct is a pure function of the frame: the same
// bits for any number of threads. Throws kCancelled soon after `cancel` is set.
class Denoiser {
  public:
    virtual ~Denoiser() = default;
    // Name with all parameters, "bilateral:mode=corrected".
    virtual std::string Describe() const = 0;
    virtual Needs GetNeeds() const { return {}; }
    // Of a method that chooses among others: what it takes. Reconstruct does the same, then that.
    virtual std::optional<Choice> Choose(const Frame&, const CancelToken&) const {
        return std::nullopt;
    }
    virtual Result Reconstruct(const Frame& frame, const CancelToken& cancel) const = 0;
    // Of a filter that leaves the quiet part of a frame as it is (noisy_part.h): what filters the
    // rest. Null: any other.
    virtual const Denoiser* OfNoisyPart() const { return nullptr; }
    // Where the method's own planner would put `samples` more, given those in the frame: expected
    // counts a pixel, row-major, `samples` in all. Empty: it has none. A pure function of the
    // frame.
    virtual Plane PlanSamples(const Frame&, double /*samples*/, const CancelToken&) const {
        return {};
    }
};

// "bilateral:mode=printed,taylor=8"; an unknown name or parameter throws kInvalidArgument with the
// known ones.
std::unique_ptr<Denoiser> MakeDenoiser(const std::string& text);

// Text for people: every filter with its source, and its parameters with defaults and units.
std::string DescribeDenoisers();

// Checks needs, runs, and replaces what came out non-finite, by the frame's own, or below black.
Result RunDenoiser(const Denoiser& denoiser, const Frame& frame, const CancelToken& cancel);

}  // namespace relume::denoise
