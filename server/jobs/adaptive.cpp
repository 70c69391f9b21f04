// The robust adaptive sampler (methods 3.2), driven by noise: for images that are not filtered.
//
//   pilot   samples a pixel in the first pass; even (default 8)
//
// After the pilot each pass doubles what the image has, or spends what is left of the budget. Its
// samples go where one sample's deviation, relative to the brightness, is large (noise_rule.h): in
// the end a pixel's count is in proportion to it. No pixel is ever done: one that has seen nothing
// stays in question as long as its neighbours' samples leave room for what it may have missed.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "core/base/error.h"
#include "core/base/param_set.h"
#include "server/jobs/noise_rule.h"
#include "server/jobs/planner.h"
#include "server/jobs/spread.h"

namespace relume::jobs {
namespace {

class Adaptive final : public Planner {
  public:
    explicit Adaptive(const ParamSet& params) : pilot_(ReadPilot(params, "adaptive", 8, 4)) {}

    std::string Describe() const override { return fmt::format("adaptive:pilot={}", pilot_); }

    // Deviations are pooled, and change little when a pass more is known.
    FilmView View() const override { return FilmView::kLagging; }

    Plan NextPass(const PlanInput& input) override {
        const Film& film = input.film;
        const std::uint64_t budget = input.budget;
        if (budget < 2 && pass_ > 0) {
            return {{}, kBudgetSpent, {}, {}};
        }
        const std::size_t pixels = film.pixel_count();
        Plan plan;
        if (pass_++ == 0) {
            plan.counts = SpreadPilot(pixels, static_cast<std::uint32_t>(pilot_), budget);
        } else {
            // A rest of less than half a pass is not worth one of its own.
            const std::vector<std::uint32_t> planned = PlannedCounts(input);
            const auto has = std::accumulate(planned.begin(), planned.end(), std::uint64_t{0});
            const std::uint64_t pass = budget < has + has / 2 ? budget : has;
            plan.counts = ShareByDeviation(planned, RelativeDeviation(film), pass, pass_);
        }
        if (std::all_of(plan.counts.begin(), plan.counts.end(),
                        [](std::uint32_t c) { return c == 0; })) {
            return {{}, budget < 2 ? kBudgetSpent : "no pixel has any noise", {}, {}};
        }
        return plan;
    }

  private:
    int pilot_;
    std::uint32_t pass_ = 0;  // passes planned so far
};

}  // namespace

std::unique_ptr<Planner> MakeAdaptive(const ParamSet& params) {
    return std::make_unique<Adaptive>(params);
}

}  // namespace relume::jobs
