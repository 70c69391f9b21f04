// The filter that chooses: of its candidates the cheapest whose error is as small as the best's.
//
// Candidates, cheapest first: none; bilateral:mode=robust on the features that help it; what the
// network of `net` makes of that and oidn, of these and nfor, and of these and rd (where oidn's
// weights are absent without that). Each is tried on a sixteenth of the frame and judged
// there by held-out samples (trial.h). Features are dropped one after the other: one without which
// the bilateral filter's error is within one standard error of the least so far. Then the cheapest
// candidate is taken whose error is within one standard error of the best one's (Breiman et al.
// 1984, section 3.4), and within 5 % of it. Below 8 samples a pixel their halves do not tell: all
// that is affordable is mixed. Light that it loses is given back (restore_energy.h). An image
// without halves, or with halves of one sample, can't be judged: it gets the bilateral filter with
// all its features.
//
//   effort    what it may cost over the bilateral filter alone, the trial included, as a part of
//             what the image's samples cost, by typical times (kSampleCost): dearer candidates are
//             not tried. 0 = any (default). Error falls with the time to the power of 0.8 or so:
//             for a candidate that lowers it to .7, from 0.6 on more samples would have been the
//             better use of the time. One that gains more may cost more, in proportion (kWithOidn).
//   seconds   what it may take; dearer candidates are not tried. 0 = any (default). With it the
//             choice may differ from run to run.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <utility>

#include "core/base/error.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/feature_groups.h"
#include "server/denoise/halves.h"
#include "server/denoise/net.h"
#include "server/denoise/restore_energy.h"
#include "server/denoise/trial.h"

namespace relume::denoise {
namespace {

// Times over the bilateral filter's (bench/filters), of kNetSlots and of the network that mixes
// them, and that of a sample a pixel of a scene that is quick to render (bench/peers): 1.4 s a
// megapixel on two cores.
constexpr std::array<double, kNetSlotCount> kCost = {0, 1, 7, 6.7, 3.2};
constexpr double kMixCost = 0.6;
constexpr double kSampleCost = 1.75;
// Candidates of the network beside that, by what they are worth for their time. On scenes that the
// network was not trained on the error was g times as large with a candidate as without (oidn .4,
// nfor .84, rd .99; nfor .68, rd .82): as error falls with time to the power of 0.8, the worth is
// g^(-1 / 0.8) - 1, over that of g = .7.
struct Other {
    std::size_t slot;
    double worth;  // times `effort`: what it may cost
};
constexpr Other kWithOidn[] = {{kOidnSlot, 3}, {kNforSlot, 0.4}, {kRdSlot, 0.02}};
constexpr Other kWithoutOidn[] = {{kNforSlot, 1}, {kRdSlot, 0.5}};
// Of the estimate of the error: both halves of a quarter of the frame by the bilateral filter.
constexpr double kEstimateCost = 0.5;
// Of what the choice may cost, that the search for features without use may.
constexpr double kFeaturesShare = 0.15;
// Samples a pixel: with one a half, all filters look worse than they are, and than none.
constexpr double kFewestToTry = 4;
// Of the error, that a cheaper candidate, or one with less features, may seem to cost.
constexpr double kMostLost = 0.05;

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
            choice.denoiser = MakeDenoiser(kNetSlots[kBilateralSlot].filter);
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
        const auto bilateral = MakeDenoiser(kNetSlots[kBilateralSlot].filter);
        if (trial.is_small()) {
            Trial::Whole whole = trial.FilterWhole(*bilateral, frame, cancel);
            runs[kBilateralSlot] = std::move(whole.run);
            choice.base_halves = std::make_shared<FilteredHalves>(std::move(whole.halves));
        } else {
            runs[kBilateralSlot] = trial.Filter(*bilateral, 2, cancel);
        }
        std::vector<const Trial::Run*> all = {&runs[kBilateralSlot]};
        const int halves = effort_ > 0 || seconds_ > 0 ? 1 : 2;
        const double tried_share = halves * trial.share(), second = runs[kBilateralSlot].seconds;
        double spent = 1 + (trial.is_small() ? 2 : 2 * trial.share() + kEstimateCost);
        std::vector<std::size_t> mixed;
        for (const auto& [k, worth] : Others(frame)) {
            const double cost =
                (tried_share + 1) * kCost[k] + (tried_share + (mixed.empty() ? 1 : 0)) * kMixCost;
            if (spent + cost <= Budget(worth, trial.samples(), second)) {
                runs[k] = trial.Filter(*MakeDenoiser(kNetSlots[k].filter), halves, cancel);
                all.push_back(&runs[k]);
                mixed.push_back(k);
                spent += cost;
            }
        }
        const Judge judge(trial, all, halves);
        const bool tries = trial.tells() && (std::size(kFeatureGroups) - 1) * tried_share <=
                                                kFeaturesShare * Budget(1, trial.samples(), second);
        Dropping dropping = DropFeatures(frame, trial, judge, std::move(runs[kBilateralSlot]),
                                         halves, tries, cancel);
        runs[kBilateralSlot] = std::move(dropping.run);

        std::vector<Tried> tried = {{"none", judge.OfNone(), 0}};
        std::vector<std::size_t> stands = {0, 1 + dropping.taken};
        std::ranges::move(dropping.tried, std::back_inserter(tried));
        std::array<const Trial::Run*, kNetSlotCount> parts = {nullptr, &runs[kBilateralSlot]};
        double seconds = runs[kBilateralSlot].seconds;
        for (const std::size_t added : mixed) {
            parts[added] = &runs[added];
            seconds += runs[added].seconds;
            const Trial::Run run = trial.Mix(parts, halves, cancel);
            NetParts names = {true};
            for (std::size_t k = 1; k < kNetSlotCount; ++k) {
                names[k] = parts[k] != nullptr;
            }
            stands.push_back(tried.size());
            tried.push_back({NetName(names, dropping.names), judge.Of(run), seconds + run.seconds});
        }
        const bool judged = trial.tells() && trial.is_wide();
        if (!judged) {
            stands = {HasNoise(frame) ? stands.back() : 0};
        }
        const std::size_t taken = Take(tried, stands, &choice);
        if (!judged && all.size() > 1) {
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

    static std::span<const Other> Others(const Frame& frame) {
        const bool has_oidn = HasNetSlot(kOidnSlot) && SuitsNetSlot(kOidnSlot, frame);
        return has_oidn ? std::span<const Other>(kWithOidn) : kWithoutOidn;
    }

    // What may be spent on what is of that worth, in units of the bilateral filter, which takes
    // `second` for the frame (0: not known).
    double Budget(double worth, double samples, double second) const {
        double budget = std::numeric_limits<double>::infinity();
        if (effort_ > 0 && samples > 0) {
            budget = 1 + static_cast<double>(effort_) * worth * samples * kSampleCost;
        }
        if (seconds_ > 0 && second > 0) {
            budget = std::min(budget, static_cast<double>(seconds_) / second);
        }
        return budget;
    }

    // Of a frame by which filters can't be judged: what is worth most, untried.
    std::string Untried(const Frame& frame, double samples) const {
        const Other& first = Others(frame)[0];
        if (1 + kCost[first.slot] + kMixCost > Budget(first.worth, samples, 0)) {
            return kNetSlots[kBilateralSlot].filter;
        }
        NetParts parts = {true, true};
        parts[first.slot] = true;
        return NetName(parts, "");
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
    return std::make_unique<Auto>(effort, seconds);
}

}  // namespace relume::denoise
