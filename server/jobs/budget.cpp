#include "server/jobs/budget.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "server/jobs/planner.h"

namespace relume::jobs {
namespace {

constexpr std::uint64_t kAny = std::numeric_limits<std::uint64_t>::max();

// Of a target: what a pass aims at, and what it may not fall below should the error fall faster by
// kSteeper than expected.
constexpr double kAim = 0.95, kFloor = 0.75;
constexpr int kSteeper = 16;  // sixteenths

// The first pass under a time limit, which measures the speed: a pair is the least that has two
// halves.
constexpr std::uint64_t kProbeSpp = 2;
constexpr std::uint64_t kPair = 2;                                        // samplers deal out pairs
constexpr double kMarginShare = 0.02, kMinMargin = 0.05, kMaxMargin = 1;  // of the limit; seconds
constexpr double kPart = 0.6;              // of what still fits is spent in a pass
constexpr double kLast = 1.0 / 16;         // of what was planned: so little is spent at once
constexpr double kSmallest = 1.0 / 50;     // less is not worth a pass
constexpr double kShortestSeconds = 0.05;  // nor is this

Stop TimeStop(const Budgets& budgets, const BudgetState& state) {
    const double spp = static_cast<double>(state.planned) / static_cast<double>(state.pixels);
    const bool late = state.planned <= kProbeSpp * state.pixels &&
                      state.seconds + state.finish_seconds > *budgets.seconds;
    return {StopReason::kTimeLimit,
            late ? fmt::format("time limit passed with {:.3g} samples a pixel; it is too short for "
                               "this image",
                               spp)
                 : "time limit reached"};
}

}  // namespace

std::string Describe(const Budgets& budgets) {
    std::vector<std::string> parts;
    if (budgets.samples) {
        parts.push_back(fmt::format("{} samples", *budgets.samples));
    }
    if (budgets.min_spp > 0) {
        parts.push_back(fmt::format("at least {} a pixel", budgets.min_spp));
    }
    if (budgets.max_spp) {
        parts.push_back(fmt::format("at most {} a pixel", *budgets.max_spp));
    }
    if (budgets.target) {
        parts.push_back(fmt::format("target {}", *budgets.target));
    }
    if (budgets.seconds) {
        parts.push_back(fmt::format("{:.3g} s", *budgets.seconds));
    }
    return fmt::format("{}", fmt::join(parts, ", "));
}

std::uint32_t PixelCap(const Budgets& budgets) {
    if (budgets.max_spp) {
        return std::min(*budgets.max_spp, kMaxPixelSamples);
    }
    return budgets.samples || budgets.seconds ? kMaxPixelSamples : kDefaultMaxSpp;
}

Allowance AllowedBySamples(const Budgets& budgets, const BudgetState& state) {
    if (!budgets.samples) {
        return {kAny, {}};
    }
    if (*budgets.samples <= state.planned) {
        return {0, Stop{StopReason::kSamples, kBudgetSpent}};
    }
    return {*budgets.samples - state.planned, {}};
}

Allowance AllowedByTime(const Budgets& budgets, const BudgetState& state) {
    if (!budgets.seconds) {
        return {kAny, {}};
    }
    if (state.planned == 0 || state.samples_per_second <= 0) {
        return {kProbeSpp * state.pixels, {}};
    }
    const double margin = std::clamp(kMarginShare * *budgets.seconds, kMinMargin, kMaxMargin);
    const auto planned = static_cast<double>(state.planned);
    // What is planned is rendered while the plan is made; the pass begins when both are done.
    const double backlog = (planned - static_cast<double>(state.done)) / state.samples_per_second;
    const double begin = state.seconds + std::max(backlog, state.plan_seconds);
    const double fits =
        state.samples_per_second * (*budgets.seconds - begin - state.finish_seconds - margin);
    if (!(fits >= std::max(kSmallest * planned, kShortestSeconds * state.samples_per_second))) {
        return {0, TimeStop(budgets, state)};
    }
    const double part = fits <= kLast * planned ? fits : kPart * fits;
    return {std::max(kPair, static_cast<std::uint64_t>(part)), {}};
}

Allowance AllowedByTarget(const Budgets& budgets, const BudgetState& state) {
    if (!budgets.target || state.errors.empty()) {
        return {kAny, {}};
    }
    const double target = *budgets.target;
    const ErrorPoint& now = state.errors.back();
    if (now.error <= target) {
        return {0, Stop{StopReason::kTarget,
                        fmt::format("target reached: estimated RelMSE {:.3g} of {:.3g}", now.error,
                                    target)}};
    }
    const Exponent p = FitExponent(state.errors, state.filtered);
    const double factor =
        std::min(Root(now.error / (kAim * target), p, 3),
                 Root(now.error / (kFloor * target), {p.sixteenths + kSteeper}, 3));
    const auto needed =
        static_cast<std::uint64_t>(std::ceil(factor * static_cast<double>(now.samples)));
    const std::uint64_t more = needed - std::min(needed, state.planned);
    return {std::max(kPair, std::min(more, state.planned)), {}};
}

Allowance NextAllowance(const Budgets& budgets, const BudgetState& state) {
    Allowance least{kAny, {}};
    for (const auto& allowed : {AllowedBySamples(budgets, state), AllowedByTarget(budgets, state),
                                AllowedByTime(budgets, state)}) {
        if (allowed.stop) {
            return allowed;
        }
        least.samples = std::min(least.samples, allowed.samples);
    }
    return least;
}

Stop CapStop(const Budgets& budgets) {
    return {StopReason::kMaxSpp,
            fmt::format("every pixel that wants more samples has {}, the most{}", PixelCap(budgets),
                        budgets.max_spp ? "" : " without --max-spp, --spp or --time-limit")};
}

}  // namespace relume::jobs
