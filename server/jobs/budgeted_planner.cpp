#include "server/jobs/budgeted_planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/base/byte_stream.h"
#include "core/base/error.h"
#include "server/jobs/spread.h"

namespace relume::jobs {
namespace {

constexpr std::uint32_t kProbe = 2;              // samples a pixel, by which the speed is measured
constexpr std::uint64_t kFewestToForecast = 16;  // samples a pixel of the whole job
constexpr double kSecondsToForecast = 20;

std::uint64_t Sum(std::span<const std::uint32_t> counts) {
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

// To at most `samples`, in pairs.
void ScaleDownPairs(std::uint64_t samples, std::vector<std::uint32_t>* counts) {
    for (auto& count : *counts) {
        count /= 2;
    }
    ScaleDown(samples / 2, counts);
    for (auto& count : *counts) {
        count *= 2;
    }
}

}  // namespace

BudgetedPlanner::BudgetedPlanner(std::shared_ptr<Planner> planner, const Budgets& budgets,
                                 Estimators estimators)
    : planner_(std::move(planner)), budgets_(budgets), estimators_(std::move(estimators)) {}

FilmView BudgetedPlanner::View() const {
    const FilmView view = planner_->View();
    const bool looks = budgets_.target || budgets_.seconds;
    return view == FilmView::kNothing && looks ? FilmView::kLagging : view;
}

std::string BudgetedPlanner::Save() const {
    ByteWriter out;
    out.PutText(planner_->Save());
    out.PutText(estimators_.save ? estimators_.save() : std::string());
    out.PutAll(errors_);
    out.PutOptional(finish_seconds_);
    out.PutOptional(plan_seconds_);
    out.PutAll(rest_);
    return out.Take();
}

void BudgetedPlanner::Restore(std::string_view bytes) {
    ByteReader in(bytes);
    planner_->Restore(in.GetText());
    const std::string_view estimator = in.GetText();
    if (estimators_.restore) {
        estimators_.restore(estimator);
    }
    errors_ = in.GetAll<ErrorPoint>();
    finish_seconds_ = in.GetOptional<double>();
    plan_seconds_ = in.GetOptional<double>();
    rest_ = in.GetAll<std::uint32_t>();
    in.End();
}

// The film may lack some of what is planned. Of a pixel that has n of m samples the variance will
// fall to n/m; of a filtered image the error as a whole falls as such pixels' errors would.
double BudgetedPlanner::ErrorWhenAllIsIn(const Input& input) const {
    const Film& film = input.film;
    const auto share = [&](std::size_t i) {
        const double has = std::max(1u, film.NextIndex(i));
        return has / std::max<double>(has, input.planned[i]);
    };
    const auto pixels = static_cast<double>(film.pixel_count());
    double sum = 0;
    if (!estimators_.error) {
        for (std::size_t i = 0; i < film.pixel_count(); ++i) {
            sum += film.EstimateRelMSE(i) * share(i);
        }
        return sum / pixels;
    }
    const Exponent p = FitExponent(errors_, estimators_.filtered);
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        sum += 1 / Power(share(i), p);
    }
    return estimators_.error(film) * pixels / sum;
}

BudgetedPlanner::Pass BudgetedPlanner::NextPass(const Input& input) {
    Pass pass;
    BudgetState state;
    state.pixels = input.film.pixel_count();
    state.planned = Sum(input.planned);
    state.samples_per_second = input.samples_per_second;
    state.filtered = estimators_.filtered;
    const double start = input.seconds();
    // Workers go on while this is done.
    const auto catch_up = [&] {
        state.seconds = input.seconds();
        state.done = std::min(state.planned,
                              input.done + static_cast<std::uint64_t>(input.samples_per_second *
                                                                      (state.seconds - start)));
    };
    if (state.planned > 0) {
        if (!finish_seconds_ && budgets_.seconds && estimators_.finish_seconds) {
            finish_seconds_ = estimators_.finish_seconds(input.film);
        }
        state.finish_seconds = pass.finish_seconds = finish_seconds_.value_or(0);
        // A guide runs the filter, too: before it was measured it is taken to need as long as the
        // finish.
        state.plan_seconds =
            !rest_.empty()
                ? 0
                : plan_seconds_.value_or(input.guide != nullptr ? state.finish_seconds : 0);
        catch_up();
        // What needs no estimate of the error first: that may cost a filter's run.
        for (const auto& allowed :
             {AllowedBySamples(budgets_, state), AllowedByTime(budgets_, state)}) {
            if (allowed.stop) {
                pass.stop = allowed.stop;
                return pass;
            }
        }
        // A part of the first pass is too little to be judged. Without a target one estimate does,
        // for the forecast: each costs time, if there is a filter its run. A job that is soon over
        // needs none.
        const bool soon_over =
            budgets_.samples &&
            (*budgets_.samples < kFewestToForecast * state.pixels ||
             static_cast<double>(*budgets_.samples - std::min(*budgets_.samples, state.done)) <
                 kSecondsToForecast * input.samples_per_second);
        const bool wanted =
            budgets_.target || !estimators_.error || (errors_.empty() && !soon_over);
        if (wanted && rest_.empty() && View() != FilmView::kNothing) {
            const double before = input.seconds();
            errors_.push_back({state.planned, ErrorWhenAllIsIn(input)});
            pass.filter_seconds += input.seconds() - before;
            pass.error = errors_.back();
        }
    }
    state.errors = errors_;
    catch_up();

    const Allowance allowed = NextAllowance(budgets_, state);
    if (allowed.stop) {
        pass.stop = allowed.stop;
        return pass;
    }
    const bool own = rest_.empty() && state.planned > 0;
    pass.plan = WithinAllowance(input, allowed.samples, state.planned, &pass.filter_seconds);
    if (own) {
        plan_seconds_ = input.seconds() - state.seconds;
    }
    if (pass.plan.counts.empty()) {
        const bool spent = pass.plan.reason == kBudgetSpent;
        pass.stop = Stop{spent ? StopReason::kSamples : StopReason::kSampler, pass.plan.reason};
        return pass;
    }
    if (!CapPixels(input, &pass.plan)) {
        pass.plan.counts.clear();
        pass.stop = CapStop(budgets_);
        return pass;
    }
    const std::uint64_t samples = state.planned + Sum(pass.plan.counts);
    pass.last = samples == budgets_.samples;
    if (!errors_.empty()) {
        pass.expected_error = ExpectedError(errors_, FitExponent(errors_, state.filtered),
                                            static_cast<double>(samples));
    }
    return pass;
}

Plan BudgetedPlanner::WithinAllowance(const Input& input, std::uint64_t allowed,
                                      std::uint64_t planned, double* filter_seconds) {
    if (!rest_.empty()) {
        Plan plan;
        plan.counts = std::exchange(rest_, {});
        if (Sum(plan.counts) > allowed) {
            ScaleDownPairs(allowed, &plan.counts);
        }
        if (Sum(plan.counts) > 0) {
            return plan;
        }
    }
    const bool probe = planned == 0 && budgets_.seconds;
    if (probe) {
        // The whole first pass, as if there were no limit.
        allowed =
            budgets_.samples.value_or(std::uint64_t{kMaxPixelSamples} * input.film.pixel_count());
    }
    const Guide timed = [&](const Film& film, double samples) {
        const double before = input.seconds();
        auto guide = (*input.guide)(film, samples);
        *filter_seconds += input.seconds() - before;
        return guide;
    };
    Plan plan = planner_->NextPass({input.film, allowed, input.planned,
                                    input.guide != nullptr ? &timed : nullptr, input.rays});
    if (plan.counts.empty()) {
        return plan;
    }
    const std::uint64_t sum = Sum(plan.counts);
    if (plan.counts.size() != input.planned.size() || sum == 0 || sum > allowed) {
        throw Error(ErrorCode::kInternal,
                    fmt::format("sampler planned {} samples for {} of {} pixels with {} left", sum,
                                plan.counts.size(), input.planned.size(), allowed));
    }
    if (planned == 0) {
        RaiseToMinimum(allowed, &plan.counts);
    }
    if (probe) {
        rest_.resize(plan.counts.size());
        for (std::size_t i = 0; i < rest_.size(); ++i) {
            const std::uint32_t first = std::min(plan.counts[i], kProbe);
            rest_[i] = plan.counts[i] - first;
            plan.counts[i] = first;
        }
        if (Sum(rest_) == 0) {
            rest_.clear();
        }
    }
    return plan;
}

void BudgetedPlanner::RaiseToMinimum(std::uint64_t allowed,
                                     std::vector<std::uint32_t>* counts) const {
    // Even, so that the halves stay equal, unless that is more than a pixel may have.
    const std::uint32_t least =
        std::min(budgets_.min_spp + budgets_.min_spp % 2, PixelCap(budgets_));
    std::vector<std::uint32_t> raised(*counts);
    for (auto& count : raised) {
        count = std::max(count, least);
    }
    if (Sum(raised) <= allowed) {
        *counts = std::move(raised);
    }
}

bool BudgetedPlanner::CapPixels(const Input& input, Plan* plan) const {
    const std::uint32_t cap = PixelCap(budgets_);
    bool any = false;
    for (std::size_t i = 0; i < plan->counts.size(); ++i) {
        const std::uint32_t room = cap - std::min(cap, input.planned[i]);
        if (plan->counts[i] > room) {
            plan->counts[i] = room;
            if (!plan->decisions.empty()) {
                plan->decisions[i] = Decision::kCapped;
            }
        }
        any = any || plan->counts[i] > 0;
    }
    // What is held back of the first pass meets the cap when its turn comes.
    return any;
}

}  // namespace relume::jobs
