// The filter that chooses: of its candidates the cheapest whose error is as small as the best's.
//
// Candidates, cheapest first: none; bilateral:mode=robust on the features that help it; rd; nfor;
// blends of two of these, and of all three, with the weights that are best (blend.h). Each is tried
// on a sixteenth of the frame and judged there by held-out samples (trial.h). Features are dropped
// one after the other: one without which the bilateral filter's error is within one standard error
// of the least so far. Then the cheapest candidate is taken whose error is within one standard
// error of the best one's (Breiman et al. 1984, section 3.4), and within 5 % of it. Below 8 samples
// a pixel their halves do not tell: all that is affordable is mixed, equally. Light that it loses
// is given back (restore_energy.h). An image without halves can't be judged: it gets the bilateral
// filter with all its features.
//
//   seconds   candidates that would take longer are not tried; 0 = none is too dear (default). With
//             it the choice may differ from run to run.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/base/error.h"
#include "server/denoise/blend.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/feature_groups.h"
#include "server/denoise/halves.h"
#include "server/denoise/restore_energy.h"
#include "server/denoise/trial.h"

namespace relume::denoise {
namespace {

// Over the bilateral filter's, as measured (bench/filters).
constexpr std::array<double, kBlendedCount> kCost = {1, 4.5, 5};
// Which of them a candidate mixes, cheapest first.
constexpr BlendWeights kMixed[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0},
                                   {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
// Of the estimate of the error: both halves of a quarter of the frame by the bilateral filter.
constexpr double kEstimateCost = 0.5;
// Of the error, that a cheaper candidate, or one with less features, may seem to cost.
constexpr double kMostLost = 0.05;

double CostOf(const BlendWeights& mixed) {
    double cost = 0;
    for (std::size_t k = 0; k < kBlendedCount; ++k) {
        cost += mixed[k] > 0 ? kCost[k] : 0;
    }
    return cost;
}

struct Tried {
    std::string name;
    Judge::Errors errors;
    double seconds;
    BlendWeights weights;  // of what it is made of
};

// The bilateral filter with fewer and fewer features.
struct Dropping {
    std::vector<Tried> tried;
    std::size_t taken = 0;  // of `tried`
    Trial::Run run;         // of that one
    std::string names;      // of what it does without, "albedo-depth"
};

Dropping DropFeatures(const Frame& frame, const Trial& trial, const Judge& judge, Trial::Run whole,
                      const CancelToken& cancel) {
    Dropping out;
    const char* name = kBlended[0].filter;
    out.tried.push_back({name, judge.Of(whole), whole.seconds, kMixed[0]});
    out.run = std::move(whole);
    std::size_t least = 0;
    for (const FeatureGroup& group : kFeatureGroups) {
        if (!trial.tells() || group.first == kVisibility || frame.feature[group.first].empty()) {
            continue;  // the bilateral filter does not look at it
        }
        const std::string more = out.names + (out.names.empty() ? "" : "-") + group.name;
        const std::string blind = fmt::format("{},without={}", name, more);
        Trial::Run run = trial.Filter(*MakeDenoiser(blind), cancel);
        out.tried.push_back({blind, judge.Of(run), run.seconds, kMixed[0]});
        const std::size_t last = out.tried.size() - 1;
        if (Judge::Compare(out.tried[last].errors, out.tried[least].errors).mean < 0) {
            least = last;
        }
        if (Judge::Compare(out.tried[last].errors, out.tried[least].errors).Holds(kMostLost)) {
            out.names = more;
            out.taken = last;
            out.run = std::move(run);
        }
    }
    return out;
}

class Auto final : public Denoiser {
  public:
    explicit Auto(float seconds) : seconds_(seconds) {}

    std::string Describe() const override {
        return seconds_ > 0 ? fmt::format("auto:seconds={:.6g}", seconds_) : "auto";
    }

    std::optional<Choice> Choose(const Frame& frame, const CancelToken& cancel) const override {
        Choice choice;
        if (!frame.has_halves() || frame.pixel_count() == 0) {
            choice.denoiser = MakeDenoiser(kBlended[0].filter);
            choice.reason = "the image has no halves to judge filters by";
            return choice;
        }
        const Trial trial(frame);
        std::array<Trial::Run, kBlendedCount> runs;
        std::vector<const Trial::Run*> all;
        for (std::size_t k = 0; k < kBlendedCount; ++k) {
            if (k == 0 || !IsTooDear(kCost[k], runs[0].seconds)) {
                runs[k] = trial.Filter(*MakeDenoiser(kBlended[k].filter), cancel);
                all.push_back(&runs[k]);
            }
        }
        const Judge judge(trial, all);
        const double base_seconds = runs[0].seconds;
        Dropping dropping = DropFeatures(frame, trial, judge, std::move(runs[0]), cancel);
        runs[0] = std::move(dropping.run);

        std::vector<Tried> tried = {{"none", judge.OfNone(), 0, {}}};
        std::vector<std::size_t> stands = {0, 1 + dropping.taken};
        std::ranges::move(dropping.tried, std::back_inserter(tried));
        for (const BlendWeights& mixed : kMixed) {
            if (mixed == kMixed[0] || IsTooDear(CostOf(mixed), base_seconds)) {
                continue;
            }
            const std::vector<const Trial::Run*> parts = Parts(runs, mixed);
            if (std::ranges::any_of(parts, [](const auto* run) { return run->windows.empty(); })) {
                continue;  // not tried, as too dear
            }
            Tried candidate{"", {}, 0, mixed};
            for (const Trial::Run* part : parts) {
                candidate.seconds += part->seconds;
            }
            if (parts.size() == 1) {
                candidate.errors = judge.Of(*parts[0]);
            } else {
                Judge::Mean mean = judge.BestMean(parts);
                candidate.errors = std::move(mean.errors);
                for (std::size_t k = 0, part = 0; k < kBlendedCount; ++k) {
                    candidate.weights[k] = mixed[k] > 0 ? mean.weights[part++] : 0;
                }
            }
            candidate.name = BlendName(candidate.weights, dropping.names);
            stands.push_back(tried.size());
            tried.push_back(std::move(candidate));
        }
        if (!trial.tells()) {
            stands = {0, stands.back()};
        }
        const std::size_t taken = Take(tried, stands, &choice);
        if (!trial.tells()) {
            choice.reason = "too few samples a pixel to tell filters apart";
        }
        for (const char c : dropping.names) {
            choice.dropped += c == '-' ? ", " : std::string(1, c);
        }
        const Judge::Ratio ratio = Judge::Divide(tried[taken].errors, tried[1].errors);
        choice.base = MakeDenoiser(tried[1].name);
        choice.over_base = ratio.ratio;
        choice.over_base_error = ratio.error;
        if (trial.tries_all() && taken > 0) {
            choice.halves = HalvesOf(Parts(runs, tried[taken].weights), tried[taken].weights);
        }
        return choice;
    }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        return RunDenoiser(*Choose(frame, cancel)->denoiser, frame, cancel);
    }

  private:
    float seconds_;  // that the image may take; 0: any

    bool IsTooDear(double cost, double base_seconds) const {
        return seconds_ > 0 &&
               (cost + kEstimateCost) * base_seconds > static_cast<double>(seconds_);
    }

    static std::vector<const Trial::Run*> Parts(const std::array<Trial::Run, kBlendedCount>& runs,
                                                const BlendWeights& weights) {
        std::vector<const Trial::Run*> parts;
        for (std::size_t k = 0; k < kBlendedCount; ++k) {
            if (weights[k] > 0) {
                parts.push_back(&runs[k]);
            }
        }
        return parts;
    }

    static std::unique_ptr<Denoiser> Make(const Tried& tried) {
        std::unique_ptr<Denoiser> denoiser = MakeDenoiser(tried.name);
        return tried.weights == BlendWeights{} ? std::move(denoiser)
                                               : RestoreEnergy(std::move(denoiser));
    }

    // Of the first window.
    static std::shared_ptr<const FilteredHalves> HalvesOf(
        const std::vector<const Trial::Run*>& parts, const BlendWeights& weights) {
        std::vector<int> used;
        std::ranges::copy_if(weights, std::back_inserter(used), [](int w) { return w > 0; });
        auto halves = std::make_shared<FilteredHalves>();
        for (std::size_t half = 0; half < 2; ++half) {
            for (std::size_t c = 0; c < 3; ++c) {
                std::vector<const Plane*> planes;
                for (const Trial::Run* part : parts) {
                    planes.push_back(&part->windows[0].color[half][c]);
                }
                halves->color[half][c] = MixPlanes(planes, used);
            }
        }
        return halves;
    }

    // One of `stands`, numbers of `tried`, cheapest first.
    static std::size_t Take(const std::vector<Tried>& tried, const std::vector<std::size_t>& stands,
                            Choice* choice) {
        std::size_t best = stands[0];
        for (const std::size_t k : stands) {
            if (Judge::Compare(tried[k].errors, tried[best].errors).mean < 0) {
                best = k;
            }
        }
        const double least =
            Judge::Compare(tried[best].errors, Judge::Errors(tried[best].errors.size(), 0.0)).mean;
        for (const Tried& candidate : tried) {
            const Judge::Difference above = Judge::Compare(candidate.errors, tried[best].errors);
            choice->candidates.push_back({Make(candidate)->Describe(), least + above.mean,
                                          above.mean, above.error, candidate.seconds});
        }
        const std::size_t taken = *std::ranges::find_if(stands, [&](std::size_t k) {
            return Judge::Compare(tried[k].errors, tried[best].errors).Holds(kMostLost);
        });
        choice->denoiser = Make(tried[taken]);
        choice->reason = taken == best ? "the least error"
                                       : fmt::format("within one standard error of {}, and cheaper",
                                                     Make(tried[best])->Describe());
        return taken;
    }
};

}  // namespace

std::unique_ptr<Denoiser> MakeAuto(const ParamSet& params) {
    const float seconds = params.GetFloat("seconds", 0);
    if (!(seconds >= 0 && seconds <= 1e9f)) {
        ThrowInvalidArgument(fmt::format("filter 'auto': seconds={} must be 0 to 1e9", seconds));
    }
    return std::make_unique<Auto>(seconds);
}

}  // namespace relume::denoise
