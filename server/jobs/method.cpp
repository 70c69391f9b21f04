// Planners of the methods that bring their own: `gem`, `nlm`, `sbf`, `rd`, `wlr`.
//
//   pilot    samples a pixel in the first pass; even
//   passes   what is left of the budget is spent in so many, in equal parts
//
// After the pilot the filter of that name is asked where the pass's samples should go
// (denoise/denoiser.h, PlanSamples), whichever filter makes the image: planner and filter are
// chosen apart. No pass has more than three times what the image has.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/byte_stream.h"
#include "core/base/error.h"
#include "core/base/param_set.h"
#include "server/jobs/planner.h"
#include "server/jobs/spread.h"

namespace relume::jobs {
namespace {

class MethodPlanner final : public Planner {
  public:
    MethodPlanner(const char* method, int pilot, int passes, const ParamSet& params)
        : method_(method),
          pilot_(ReadPilot(params, method, pilot, 4)),
          passes_(params.GetInt("passes", passes)) {
        if (passes_ < 1 || passes_ > 1000) {
            ThrowInvalidArgument(
                fmt::format("sampler '{}': passes={} must be 1 to 1000", method, passes_));
        }
    }

    std::string Describe() const override {
        return fmt::format("{}:pilot={},passes={}", method_, pilot_, passes_);
    }
    FilmView View() const override { return FilmView::kLagging; }
    const char* Method() const override { return method_; }

    Plan NextPass(const PlanInput& input) override {
        const std::size_t pixels = input.film.pixel_count();
        if (input.budget < 2 && pass_ > 0) {
            return {{}, kBudgetSpent, {}, {}};
        }
        Plan plan;
        if (pass_++ == 0) {
            plan.counts = SpreadPilot(pixels, static_cast<std::uint32_t>(pilot_), input.budget);
            return plan;
        }
        if (input.guide == nullptr) {
            throw Error(ErrorCode::kInternal,
                        fmt::format("sampler '{}' was not given the filter's plan", method_));
        }
        const std::vector<std::uint32_t> planned = PlannedCounts(input);
        const auto has = std::accumulate(planned.begin(), planned.end(), std::uint64_t{0});
        const auto left = static_cast<std::uint64_t>(std::max(1, passes_ + 2 - pass_));
        const std::uint64_t share = (input.budget + left - 1) / left;
        const std::uint64_t most = std::max<std::uint64_t>(2, 3 * has);
        const std::uint64_t samples = std::clamp<std::uint64_t>(share, 2, most);
        plan.selector = (*input.guide)(input.film, static_cast<double>(samples));
        // A method that asks for nothing is given every pixel alike.
        double sum = 0;
        for (const float expected : plan.selector) {
            sum += expected;
        }
        if (plan.selector.size() != pixels || !(sum > 0) || !std::isfinite(sum)) {
            plan.selector.assign(pixels, 0.0f);
            plan.counts = SpreadEvenly(pixels, samples, 2);
        } else {
            plan.counts = RoundToPairs(
                pixels, [&](std::size_t i) { return plan.selector[i]; }, samples,
                static_cast<std::uint32_t>(pass_));
            if (std::all_of(plan.counts.begin(), plan.counts.end(),
                            [](std::uint32_t c) { return c == 0; })) {
                plan.counts = SpreadEvenly(pixels, samples, 2);
            }
        }
        plan.decisions.resize(pixels);
        for (std::size_t i = 0; i < pixels; ++i) {
            plan.decisions[i] = plan.counts[i] > 0 ? Decision::kSampled : Decision::kConverged;
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
        pass_ = in.Get<int>();
        in.End();
    }

  private:
    const char* method_;
    int pilot_, passes_;
    int pass_ = 0;  // passes planned so far
};

}  // namespace

// Pilots and passes as the methods' papers and programs have them (methods 2.2 to 2.7).
std::unique_ptr<Planner> MakeGem(const ParamSet& params) {
    return std::make_unique<MethodPlanner>("gem", 4, 8, params);
}
std::unique_ptr<Planner> MakeNlm(const ParamSet& params) {
    return std::make_unique<MethodPlanner>("nlm", 4, 8, params);
}
std::unique_ptr<Planner> MakeSbf(const ParamSet& params) {
    return std::make_unique<MethodPlanner>("sbf", 8, 1, params);
}
std::unique_ptr<Planner> MakeRd(const ParamSet& params) {
    return std::make_unique<MethodPlanner>("rd", 4, 3, params);
}
std::unique_ptr<Planner> MakeWlr(const ParamSet& params) {
    return std::make_unique<MethodPlanner>("wlr", 4, 8, params);
}

}  // namespace relume::jobs
