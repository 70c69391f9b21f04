// The filter that chooses: of its candidates the cheapest whose error is as small as the best's.
//
// Candidates, cheapest first: none; bilateral:mode=robust on the features that help it; rd; nfor.
// Each is tried on a sixteenth of the frame and judged there by held-out samples
// (trial.h). Features are dropped one after the other: one without which the error is within one
// standard error of the least so far. Then the cheapest candidate is taken whose error is within
// one standard error of the best one's (Breiman et al. 1984, section 3.4). An image without halves
// can't be judged: it gets the bilateral filter with all its features.
//
//   seconds   candidates that would take longer are not tried; 0 = none is too dear (default). With
//             it the choice may differ from run to run.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "core/base/error.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/feature_groups.h"
#include "server/denoise/trial.h"
#include "server/denoise/without_features.h"

namespace relume::denoise {
namespace {

constexpr const char* kBase = "bilateral:mode=robust";
constexpr const char* kNone = "none";
// Dearer ones.
constexpr struct {
    const char* name;
    double cost;  // over the bilateral filter's, as measured (bench/filters)
} kFurther[] = {{"rd", 4.5}, {"nfor", 5}};
// To filter the image, and a part of its halves for the estimate of the error, over filtering
// alone.
constexpr double kWithEstimate = 1.5;

class Auto final : public Denoiser {
  public:
    explicit Auto(float seconds) : seconds_(seconds) {}

    std::string Describe() const override {
        return seconds_ > 0 ? fmt::format("auto:seconds={:.6g}", seconds_) : "auto";
    }

    std::optional<Choice> Choose(const Frame& frame, const CancelToken& cancel) const override {
        Choice choice;
        if (!frame.has_halves() || frame.pixel_count() == 0) {
            choice.denoiser = MakeDenoiser(kBase);
            choice.reason = "the image has no halves to judge filters by";
            return choice;
        }
        const auto base = MakeDenoiser(kBase);
        const Trial trial(frame, *base, cancel);
        std::vector<Tried> tried;
        tried.push_back({kNone, trial.unfiltered(), 0});
        std::vector<std::size_t> stands = {0};
        std::string dropped;
        tried.push_back({kBase, trial.base(), trial.base_seconds()});
        stands.push_back(DropFeatures(frame, trial, cancel, &tried, &dropped));
        for (const auto& further : kFurther) {
            if (seconds_ > 0 && kWithEstimate * further.cost * trial.base_seconds() >
                                    static_cast<double>(seconds_)) {
                continue;
            }
            tried.push_back(Judge(trial, further.name, cancel));
            stands.push_back(tried.size() - 1);
        }
        // What is of no use to the bilateral filter is of none to the best, if that holds.
        std::size_t& best = *std::ranges::min_element(
            stands, {}, [&](std::size_t k) { return trial.Mean(tried[k].errors); });
        const std::string blind = tried[stands[1]].name.substr(std::strlen(kBase));
        if (&best > &stands[1] && !blind.empty()) {
            tried.push_back(Judge(trial, tried[best].name + (":" + blind.substr(1)), cancel));
            if (trial.Compare(tried.back().errors, tried[best].errors).Holds()) {
                best = tried.size() - 1;
            }
        }
        return Take(trial, tried, stands, dropped);
    }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        return RunDenoiser(*Choose(frame, cancel)->denoiser, frame, cancel);
    }

  private:
    float seconds_;  // that the image may take; 0: any

    struct Tried {
        std::string name;
        Trial::Errors errors;
        double seconds;
    };

    static Tried Judge(const Trial& trial, const std::string& name, const CancelToken& cancel) {
        Tried candidate{name, {}, 0};
        candidate.errors = trial.Judge(*MakeDenoiser(name), cancel, &candidate.seconds);
        return candidate;
    }

    // Adds the last one of `tried` with fewer and fewer features; the number of the one to take.
    static std::size_t DropFeatures(const Frame& frame, const Trial& trial,
                                    const CancelToken& cancel, std::vector<Tried>* tried,
                                    std::string* dropped) {
        std::size_t taken = tried->size() - 1, least = taken;
        const std::string name = tried->back().name;
        std::string without;
        for (const FeatureGroup& group : kFeatureGroups) {
            if (group.first == kVisibility || frame.feature[group.first].empty()) {
                continue;  // the bilateral filter does not look at it
            }
            const std::string more = without + (without.empty() ? "" : "-") + group.name;
            tried->push_back(Judge(trial, fmt::format("{},without={}", name, more), cancel));
            const std::size_t last = tried->size() - 1;
            if (trial.Mean((*tried)[last].errors) < trial.Mean((*tried)[least].errors)) {
                least = last;
            }
            if (trial.Compare((*tried)[last].errors, (*tried)[least].errors).Holds()) {
                without = more;
                taken = last;
                *dropped += (dropped->empty() ? "" : ", ") + std::string(group.name);
            }
        }
        return taken;
    }

    // One of `stands`, numbers of `tried`, cheapest first.
    static Choice Take(const Trial& trial, const std::vector<Tried>& tried,
                       const std::vector<std::size_t>& stands, const std::string& dropped) {
        std::size_t best = stands[0];
        for (const std::size_t k : stands) {
            if (trial.Mean(tried[k].errors) < trial.Mean(tried[best].errors)) {
                best = k;
            }
        }
        Choice choice;
        for (const Tried& candidate : tried) {
            const Trial::Difference above = trial.Compare(candidate.errors, tried[best].errors);
            choice.candidates.push_back({candidate.name, trial.Mean(candidate.errors), above.mean,
                                         above.error, candidate.seconds});
        }
        const std::size_t taken = *std::ranges::find_if(stands, [&](std::size_t k) {
            return trial.Compare(tried[k].errors, tried[best].errors).Holds();
        });
        choice.denoiser = MakeDenoiser(tried[taken].name);
        choice.reason = taken == best ? "the least error"
                                      : fmt::format("within one standard error of {}, and cheaper",
                                                    tried[best].name);
        choice.dropped = dropped;
        return choice;
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
