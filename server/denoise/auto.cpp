// The filter that chooses: of its candidates the cheapest whose error is as small as the best's.
//
// Candidates, cheapest first: none; bilateral:mode=robust on the features that help it; what the
// network of `net` makes of that and oidn, of these and rd, and of these and nfor (where oidn's
// weights are absent without that). Each is tried on a sixteenth of the frame and judged
// there by held-out samples (trial.h). Features are dropped one after the other: one without which
// the bilateral filter's error is within one standard error of the least so far. Then the cheapest
// candidate is taken whose error is within one standard error of the best one's (Breiman et al.
// 1984, section 3.4), and within 5 % of it. Below 8 samples a pixel their halves do not tell: all
// that is affordable is mixed. Light that it loses is given back (restore_energy.h). An image
// without halves, or with halves of one sample, can't be judged: it gets the bilateral filter with
// all its features.
//
//   effort    what it may cost over the bilateral filter alone, the trial included, over what the
//             samples cost that would have gained as much, by typical times and gains and what is
//             known of the samples (worth.h): dearer candidates are not tried. Beyond 1 more
//             samples would have been the better use of the time. 0 = any (default).
//   seconds   what it may take; dearer candidates are not tried. 0 = any (default). With it the
//             choice may differ from run to run.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

#include "core/base/error.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/error_estimate.h"
#include "server/denoise/feature_groups.h"
#include "server/denoise/halves.h"
#include "server/denoise/net.h"
#include "server/denoise/noisy_part.h"
#include "server/denoise/purse.h"
#include "server/denoise/restore_energy.h"
#include "server/denoise/trial.h"
#include "server/denoise/worth.h"

namespace relume::denoise {
namespace {

// Of the estimate of the error: both halves of a quarter of the frame by the bilateral filter.
constexpr double kEstimateCost = 0.5;
// What is expected of the search for features without use: error over that without it.
constexpr double kFeaturesGain = 0.98;
// Samples a pixel: with one a half, all filters look worse than they are, and than none.
constexpr double kFewestToTry = 4;
// Of the error, that a cheaper candidate, or one with less features, may seem to cost.
constexpr double kMostLost = 0.05;

// Standard errors by which the bilateral filter has to be better than all that is affordable, where
// the trial is too small to go by otherwise.
constexpr double kClearly = 2;

struct Tried {
    std::string name;
    Judge::Errors errors;
    double seconds;
};

// The bilateral filter with fewer and fewer features.
struct Dropping {
    std::vector<Tried> tried;
    std::size_t taken = 0;  // of `tried`
    Trial::Run run;         // of that one
    std::string names;      // of what it does without, "albedo-depth"
};

Dropping DropFeatures(const Frame& frame, const Trial& trial, const Judge& judge, Trial::Run whole,
                      int halves, bool tries, const CancelToken& cancel) {
    Dropping out;
    const char* name = kNetSlots[kBilateralSlot].filter;
    out.tried.push_back({name, judge.Of(whole), whole.seconds});
    out.run = std::move(whole);
    std::size_t least = 0;
    for (const FeatureGroup& group : kFeatureGroups) {
        if (!tries || group.first == kVisibility || frame.feature[group.first].empty()) {
            continue;  // the bilateral filter does not look at it
        }
        const std::string more = out.names + (out.names.empty() ? "" : "-") + group.name;
        const std::string blind = fmt::format("{},without={}", name, more);
        Trial::Run run = trial.Filter(*MakeDenoiser(blind), halves, cancel);
        out.tried.push_back({blind, judge.Of(run), run.seconds});
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

bool HasNoise(const Frame& frame) {
    return std::ranges::any_of(frame.variance, [](const Plane& variance) {
        return std::ranges::any_of(variance, [](float v) { return v > 0; });
    });
}

class Auto final : public Denoiser {
  public:
    Auto(float effort, float seconds) : effort_(effort), seconds_(seconds) {}

    std::string Describe() const override {
        std::string text = "auto";
        for (const auto& [name, value] : {std::pair{"effort", effort_}, {"seconds", seconds_}}) {
            if (value > 0) {
                text += fmt::format("{}{}={:.6g}", text == "auto" ? ":" : ",", name, value);
            }
        }
        return text;
    }

    std::optional<Choice> Choose(const Frame& frame, const CancelToken& cancel) const override {
        Choice choice;
        if (!frame.has_halves() || frame.pixel_count() == 0) {
            choice.denoiser = RestoreEnergy(MakeDenoiser(kNetSlots[kBilateralSlot].filter));
            choice.reason = "the image has no halves to judge filters by";
            return choice;
        }
        const Trial trial(frame);
        if (trial.samples() > 0 && trial.samples() < kFewestToTry) {
            choice.denoiser = RestoreEnergy(MakeDenoiser(Untried(frame, trial.samples())));
            choice.reason = "halves of one sample a pixel say nothing of filters";
            return choice;
        }
        std::array<Trial::Run, kNetSlotCount> runs;
        const std::unique_ptr<const Denoiser> bilateral =
            MakeDenoiser(kNetSlots[kBilateralSlot].filter);
        if (trial.is_small()) {
            Trial::Whole whole = trial.FilterWhole(*bilateral, frame, cancel);
            runs[kBilateralSlot] = std::move(whole.run);
            choice.base_error =
                std::make_shared<const ErrorEstimate>(JudgeHalves(frame, whole.halves));
        } else {
            runs[kBilateralSlot] = trial.Filter(*bilateral, 2, cancel);
            choice.base_windows = trial.JudgeWindows(runs[kBilateralSlot]);
        }
        const double left = LeftOfNone(trial, runs[kBilateralSlot], choice.base_error.get());
        std::vector<const Trial::Run*> all = {&runs[kBilateralSlot]};
        const int halves = effort_ > 0 || seconds_ > 0 ? 1 : 2;
        const double tried_share = halves * trial.share();
        Purse purse(effort_, seconds_, frame.sampling, trial.samples(),
                    runs[kBilateralSlot].seconds);
        purse.Spend(1 + (trial.is_small() ? 2 : std::max(2 * trial.share(), kEstimateCost)));
        std::vector<std::size_t> mixed;
        NetSpec spec;
        for (const auto& [k, gain] : ExpectedGains(HasOidn(frame), left)) {
            const double whole = tried_share + 1, mix = tried_share + (mixed.empty() ? 1 : 0);
            if (purse.Buy(whole * kFilterCost[k] + mix * MixCost(frame.pixel_count()), gain)) {
                if (k == kOidnSlot) {
                    spec.prefilters_oidn = purse.Buy(whole * kPrefilterCost, kPrefilterGain);
                }
                runs[k] = trial.Filter(*MakeDenoiser(spec.FilterOf(k)), halves, cancel);
                all.push_back(&runs[k]);
                mixed.push_back(k);
            }
        }
        const Judge judge(trial, all, halves);
        const bool tries = trial.tells() &&
                           purse.Buy((std::size(kFeatureGroups) - 1) * tried_share, kFeaturesGain);
        Dropping dropping = DropFeatures(frame, trial, judge, std::move(runs[kBilateralSlot]),
                                         halves, tries, cancel);
        runs[kBilateralSlot] = std::move(dropping.run);

        std::vector<Tried> tried = {{"none", judge.OfNone(), 0}};
        std::vector<std::size_t> stands = {0, 1 + dropping.taken};
        std::ranges::move(dropping.tried, std::back_inserter(tried));
        std::array<const Trial::Run*, kNetSlotCount> parts = {nullptr, &runs[kBilateralSlot]};
        double seconds = runs[kBilateralSlot].seconds;
        spec.without = dropping.names;
        for (const std::size_t added : mixed) {
            parts[added] = &runs[added];
            seconds += runs[added].seconds;
            const Trial::Run run = trial.Mix(parts, halves, cancel);
            spec.parts[added] = true;
            stands.push_back(tried.size());
            tried.push_back({NetName(spec), judge.Of(run), seconds + run.seconds});
        }
        const bool judged = trial.tells() && trial.is_wide();
        bool worse = false;
        if (!judged) {
            const Judge::Difference more =
                Judge::Compare(tried[stands.back()].errors, tried[stands[1]].errors);
            worse = trial.tells() && more.error > 0 && more.mean > kClearly * more.error;
            stands = {HasNoise(frame) ? stands[worse ? 1 : stands.size() - 1] : 0};
        }
        const std::size_t taken = Take(tried, stands, &choice);
        if (!judged && !worse && all.size() > 1) {
            choice.reason = trial.tells() ? "too small an image to tell filters apart"
                                          : "too few samples a pixel to tell filters apart";
        }
        for (const char c : dropping.names) {
            choice.dropped += c == '-' ? ", " : std::string(1, c);
        }
        const Judge::Ratio ratio = Judge::Divide(tried[taken].errors, tried[1].errors);
        choice.base = MakeDenoiser(tried[1].name);
        choice.over_base = ratio.ratio;
        choice.over_base_error = ratio.error;
        return choice;
    }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        return RunDenoiser(*Choose(frame, cancel)->denoiser, frame, cancel);
    }

  private:
    float effort_, seconds_;  // 0: any

    static bool HasOidn(const Frame& frame) {
        return HasNetSlot(kOidnSlot) && SuitsNetSlot(kOidnSlot, frame);
    }

    // Estimated error of the bilateral filter's image over that of the noisy one; 0: can't be told.
    // `whole`: that estimate of the whole frame; null: by the trial.
    static double LeftOfNone(const Trial& trial, const Trial::Run& bilateral,
                             const ErrorEstimate* whole) {
        if (!trial.tells()) {
            return 0;
        }
        if (whole != nullptr) {
            return whole->unfiltered > 0 ? whole->relmse / whole->unfiltered : 0;
        }
        const Trial::Run* runs[] = {&bilateral};
        const Judge judge(trial, runs, 2);
        const Judge::Errors filtered = judge.Of(bilateral), none = judge.OfNone();
        const double error = std::accumulate(filtered.begin(), filtered.end(), 0.0);
        const double noisy = std::accumulate(none.begin(), none.end(), 0.0);
        return noisy > 0 ? error / noisy : 0;
    }

    // Of a frame by which filters can't be judged: what is worth most, untried.
    std::string Untried(const Frame& frame, double samples) const {
        const bool has_oidn = HasOidn(frame);
        const Gain first = ExpectedGains(has_oidn, 0)[0];
        Purse purse(effort_, seconds_, frame.sampling, samples, 0);
        purse.Spend(1);
        if (!purse.Buy(kFilterCost[first.slot] + MixCost(frame.pixel_count()), first.gain)) {
            return kNetSlots[kBilateralSlot].filter;
        }
        NetSpec spec;
        spec.parts[first.slot] = true;
        spec.prefilters_oidn = has_oidn && purse.Buy(kPrefilterCost, kPrefilterGain);
        return NetName(spec);
    }

    static std::unique_ptr<Denoiser> Make(const Tried& tried) {
        std::unique_ptr<Denoiser> denoiser = MakeDenoiser(tried.name);
        return tried.name == "none" ? std::move(denoiser) : RestoreEnergy(std::move(denoiser));
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
    const float effort = params.GetFloat("effort", 0), seconds = params.GetFloat("seconds", 0);
    for (const auto& [name, value] : {std::pair{"effort", effort}, {"seconds", seconds}}) {
        if (!(value >= 0 && value <= 1e9f)) {
            ThrowInvalidArgument(fmt::format("filter 'auto': {}={} must be 0 to 1e9", name, value));
        }
    }
    return OnNoisyPart(std::make_unique<Auto>(effort, seconds), "");
}

}  // namespace relume::denoise
