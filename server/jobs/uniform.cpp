// Uniform sampling, the baseline: the same number of samples everywhere.
//
//   pilot   samples a pixel in the first pass; even (default 4)
//
// Each further pass doubles the count, so that halves stay (0,m,2)-nets of powers of two
// (methods 5.3), until the budget is spent. The last pass deals out what is left in pairs, to
// scattered pixels where it is not enough for all: a budget of 5 samples a pixel means 4 for one
// half of them and 6 for the other.
#include <fmt/format.h>

#include <algorithm>

#include "core/base/byte_stream.h"
#include "core/base/error.h"
#include "core/base/param_set.h"
#include "server/jobs/planner.h"
#include "server/jobs/spread.h"

namespace relume::jobs {
namespace {

class Uniform final : public Planner {
  public:
    explicit Uniform(const ParamSet& params) : pilot_(ReadPilot(params, "uniform", 4, 2)) {}

    std::string Describe() const override { return fmt::format("uniform:pilot={}", pilot_); }

    FilmView View() const override { return FilmView::kNothing; }

    Plan NextPass(const PlanInput& input) override {
        const Film& film = input.film;
        const std::uint64_t budget = input.budget;
        const std::size_t pixels = film.pixel_count();
        Plan plan;
        if (spp_ == 0) {
            spp_ = static_cast<std::uint32_t>(pilot_);
            plan.counts = SpreadPilot(pixels, spp_, budget);
        } else if (const std::uint64_t next = std::uint64_t{spp_} * pixels; budget >= next) {
            plan.counts.assign(pixels, spp_);
            spp_ *= 2;
        } else {
            plan.counts = SpreadEvenly(pixels, budget, 2);
        }
        if (std::all_of(plan.counts.begin(), plan.counts.end(),
                        [](std::uint32_t c) { return c == 0; })) {
            return {{}, kBudgetSpent, {}, {}};
        }
        return plan;
    }

    std::string Save() const override {
        ByteWriter out;
        out.Put(spp_);
        return out.Take();
    }
    void Restore(std::string_view bytes) override {
        ByteReader in(bytes);
        spp_ = in.Get<std::uint32_t>();
        in.End();
    }

  private:
    int pilot_;
    std::uint32_t spp_ = 0;  // that every pixel has, before the last pass
};

}  // namespace

std::unique_ptr<Planner> MakeUniform(const ParamSet& params) {
    return std::make_unique<Uniform>(params);
}

}  // namespace relume::jobs
