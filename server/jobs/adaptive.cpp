// The robust adaptive sampler (methods 3.2 and 5.5).
//
//   pilot   samples a pixel in the first pass; even (default 4)
//   by      what says where samples go: `filter`, where the filtered halves disagree, if the image
//           is filtered; `noise`, where the samples are noisy, whatever follows; `auto` (default),
//           as `filter` if samples take so many rays that the look is worth it
//
// After the pilot each pass doubles what the image has, or spends what is left of the budget. Its
// samples go where one sample's deviation, relative to the brightness, is large (noise_rule.h), or
// where the filter makes different images of the two halves (guide_rule.h): in the end a pixel's
// count is in proportion to that. The selector is the square of that over the count: the relative
// squared error that is left. No pixel gets more than three times what it has in a pass, so
// that one firefly draws little, and none is ever done: one that has seen nothing stays in question
// as long as there is light about.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "core/base/byte_stream.h"
#include "core/base/param_set.h"
#include "server/jobs/guide_rule.h"
#include "server/jobs/neyman.h"
#include "server/jobs/noise_rule.h"
#include "server/jobs/planner.h"
#include "server/jobs/spread.h"

namespace relume::jobs {
namespace {

// Rays a sample, to look at filtered halves. What a look saves is worth 0.6 to 1.2 samples of each
// pixel (bench/sampling: the filtered error is .90, .93, .96 and .96 of that by noise at 8, 16, 32
// and 64), of which 0.6 may be spent, as on filters (server/rpc/job_spec.cpp); it takes as long as
// 1.4 rays of each (server/denoise/worth.h).
constexpr double kFewestRays = 3;

class Adaptive final : public Planner {
  public:
    explicit Adaptive(const ParamSet& params)
        : pilot_(ReadPilot(params, "adaptive", 4, 4)),
          by_(params.GetChoice("by", "auto", {"auto", "filter", "noise"})) {}

    std::string Describe() const override {
        return fmt::format("adaptive:pilot={},by={}", pilot_, by_);
    }

    // Deviations are pooled, and change little when a pass more is known.
    FilmView View() const override { return FilmView::kLagging; }

    Plan NextPass(const PlanInput& input) override {
        const Film& film = input.film;
        const std::uint64_t budget = input.budget;
        if (budget < 2 && pass_ > 0) {
            return {{}, kBudgetSpent, {}, {}};
        }
        Plan plan;
        if (pass_++ == 0) {
            plan.counts =
                SpreadPilot(film.pixel_count(), static_cast<std::uint32_t>(pilot_), budget);
            return plan;
        }
        // A rest of less than half a pass is not worth one of its own.
        const std::vector<std::uint32_t> planned = PlannedCounts(input);
        const auto has = std::accumulate(planned.begin(), planned.end(), std::uint64_t{0});
        const std::uint64_t pass = budget < has + has / 2 ? budget : has;
        std::vector<float> deviation = RelativeDeviation(film);
        if (input.guide != nullptr && LooksAtFilter(input.rays)) {
            deviation =
                GuidedDeviation(film, (*input.guide)(film, static_cast<double>(pass)), deviation);
        }
        plan.counts = ShareByDeviation(planned, deviation, pass, pass_);
        plan.selector.resize(planned.size());
        plan.decisions.resize(planned.size());
        for (std::size_t i = 0; i < planned.size(); ++i) {
            plan.selector[i] =
                deviation[i] * deviation[i] / static_cast<float>(std::max(1u, planned[i]));
            plan.decisions[i] = plan.counts[i] > 0 ? Decision::kSampled : Decision::kConverged;
        }
        if (std::all_of(plan.counts.begin(), plan.counts.end(),
                        [](std::uint32_t c) { return c == 0; })) {
            plan.counts.clear();
            plan.reason = "no pixel has any noise";
        }
        return plan;
    }

    std::string Save() const override {
        ByteWriter out;
        out.Put(pass_);
        return out.Take();
    }
    void Restore(std::string_view bytes) override {
        ByteReader in(bytes);
        pass_ = in.Get<std::uint32_t>();
        in.End();
    }

  private:
    bool LooksAtFilter(double rays) const {
        return by_ == "filter" || (by_ == "auto" && (rays == 0 || rays >= kFewestRays));
    }

    int pilot_;
    std::string by_;
    std::uint32_t pass_ = 0;  // passes planned so far
};

}  // namespace

std::unique_ptr<Planner> MakeAdaptive(const ParamSet& params) {
    return std::make_unique<Adaptive>(params);
}

}  // namespace relume::jobs
