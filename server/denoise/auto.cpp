// The filter that chooses: of its candidates the cheapest whose error is as small as the best's.
//
// Candidates, cheapest first: none; bilateral:mode=robust on the features that help it; nfor on
// the same. Each is tried on an eighth of the frame and judged there by held-out samples (trial.h).
// Features are dropped first, one after the other: one without which the bilateral filter's error
// is within one standard error of the least so far. Then the cheapest candidate is taken whose
// error is within one standard error of the best one's (Breiman et al. 1984, section 3.4). An image
// without halves can't be judged: it gets the bilateral filter with all its features.
#include <fmt/format.h>

#include <utility>

#include "server/denoise/denoiser.h"
#include "server/denoise/trial.h"
#include "server/denoise/without_features.h"

namespace relume::denoise {
namespace {

constexpr const char* kBase = "bilateral:mode=robust";
constexpr const char* kNone = "none";
// Dearer ones.
constexpr const char* kFurther[] = {"nfor"};

class Auto final : public Denoiser {
  public:
    std::string Describe() const override { return "auto"; }

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
        tried.push_back({kBase, trial.base(), trial.base_seconds()});
        const auto judge = [&](const std::string& name) {
            Tried candidate{name, {}, 0};
            candidate.errors = trial.Judge(*MakeDenoiser(name), cancel, &candidate.seconds);
            tried.push_back(std::move(candidate));
        };
        std::string without, dropped;
        std::size_t bilateral = 1, least = 1;
        for (const FeatureGroup& group : kFeatureGroups) {
            if (group.first == kVisibility || frame.feature[group.first].empty()) {
                continue;  // the bilateral filter does not look at it
            }
            const std::string more = without + (without.empty() ? "" : "-") + group.name;
            judge(fmt::format("{},without={}", kBase, more));
            const Trial::Difference raised =
                trial.Compare(tried.back().errors, tried[least].errors);
            if (trial.Mean(tried.back().errors) < trial.Mean(tried[least].errors)) {
                least = tried.size() - 1;
            }
            if (raised.mean <= raised.error) {
                without = more;
                bilateral = tried.size() - 1;
                dropped += (dropped.empty() ? "" : ", ") + std::string(group.name);
            }
        }
        for (const char* name : kFurther) {
            judge(name + (without.empty() ? "" : ":without=" + without));
        }
        return Take(trial, tried, bilateral, dropped);
    }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        return RunDenoiser(*Choose(frame, cancel)->denoiser, frame, cancel);
    }

  private:
    struct Tried {
        std::string name;
        Trial::Errors errors;
        double seconds;
    };

    // Of the bilateral filter's, number `bilateral` alone stands for it.
    static Choice Take(const Trial& trial, const std::vector<Tried>& tried, std::size_t bilateral,
                       const std::string& dropped) {
        const auto is_bilateral = [&](std::size_t k) { return tried[k].name.starts_with(kBase); };
        std::size_t best = bilateral;
        for (std::size_t k = 0; k < tried.size(); ++k) {
            if (!is_bilateral(k) && trial.Mean(tried[k].errors) < trial.Mean(tried[best].errors)) {
                best = k;
            }
        }
        Choice choice;
        std::size_t taken = tried.size();
        for (std::size_t k = 0; k < tried.size(); ++k) {
            const Trial::Difference above = trial.Compare(tried[k].errors, tried[best].errors);
            choice.candidates.push_back({tried[k].name, trial.Mean(tried[k].errors), above.mean,
                                         above.error, tried[k].seconds});
            const bool stands = !is_bilateral(k) || k == bilateral;
            if (stands && taken == tried.size() && above.mean <= above.error) {
                taken = k;
            }
        }
        choice.denoiser = MakeDenoiser(tried[taken].name);
        choice.reason = taken == best ? "the least error"
                                      : fmt::format("within one standard error of {}, and cheaper",
                                                    tried[best].name);
        choice.dropped = dropped;
        return choice;
    }
};

}  // namespace

std::unique_ptr<Denoiser> MakeAuto(const ParamSet&) { return std::make_unique<Auto>(); }

}  // namespace relume::denoise
