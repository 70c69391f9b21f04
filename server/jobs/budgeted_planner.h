#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/film/film.h"
#include "server/jobs/budget.h"
#include "server/jobs/error_curve.h"
#include "server/jobs/planner.h"

namespace relume::jobs {

// What a job's image is told from. Thread-safe functions of the film.
struct Estimators {
    // Estimated RelMSE of the image that the film will become; unset: the film's own estimate.
    std::function<double(const Film&)> error;
    // Seconds that the film will need to become a result. Unset: none.
    std::function<double(const Film&)> finish_seconds;
    bool filtered = false;  // the image is
    // What `error` keeps from film to film, as in Planner. Unset: nothing.
    std::function<std::string()> save;
    std::function<void(std::string_view)> restore;
};

// A planner's passes within budgets: each is cut to what samples, target and time allow and to what
// a pixel may have; ends when one of them, or the planner, says so. Serves one job; not
// thread-safe.
class BudgetedPlanner {
  public:
    BudgetedPlanner(std::shared_ptr<Planner> planner, const Budgets& budgets,
                    Estimators estimators);

    // The planner's own, but target and time can't be judged without a film.
    FilmView View() const;

    struct Input {
        const Film& film;  // what View says; of the first pass a black one
        // Samples of each pixel that are planned so far, in the film or still to come.
        std::span<const std::uint32_t> planned;
        const Guide* guide = nullptr;
        std::uint64_t done = 0;           // samples rendered
        double samples_per_second = 0;    // 0: not known
        std::function<double()> seconds;  // since the job was made, as of now
        double rays = 0;                  // as in PlanInput
    };
    struct Pass {
        Plan plan;  // without counts: no more passes
        std::optional<Stop> stop;
        bool last = false;  // the sample budget is spent with it
        // Estimated, of the image that all planned samples would make.
        std::optional<ErrorPoint> error;
        double finish_seconds = 0;
        double filter_seconds = 0;             // spent in the guide and in estimates of the error
        std::optional<double> expected_error;  // after this pass
    };
    // The first pass shows no film: it is the planner's first, at least min_spp a pixel. With a
    // time limit it comes in two: a pair a pixel, by which the speed is measured, and the rest as
    // far as it fits.
    Pass NextPass(const Input& input);

    // As in Planner, with what the planner and the estimators keep. The budgets may be others.
    std::string Save() const;
    void Restore(std::string_view bytes);

  private:
    double ErrorWhenAllIsIn(const Input& input) const;
    Plan WithinAllowance(const Input& input, std::uint64_t allowed, std::uint64_t planned,
                         double* filter_seconds);
    void RaiseToMinimum(std::uint64_t allowed, std::vector<std::uint32_t>* counts) const;
    // False if nothing is left.
    bool CapPixels(const Input& input, Plan* plan) const;

    std::shared_ptr<Planner> planner_;
    Budgets budgets_;
    Estimators estimators_;
    std::vector<ErrorPoint> errors_;
    std::optional<double> finish_seconds_;
    std::optional<double> plan_seconds_;  // of the planner's last pass but the first
    std::vector<std::uint32_t> rest_;     // of the first pass
};

}  // namespace relume::jobs
