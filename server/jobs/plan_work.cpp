#include "server/jobs/plan_work.h"

#include <fmt/format.h>

#include <exception>
#include <new>
#include <utility>

#include "core/base/clock.h"
#include "core/base/error.h"
#include "server/jobs/cover.h"

namespace relume::jobs {
namespace {

void MakePlan(const PlanWork& work, PlanResult* result) {
    std::shared_ptr<const Film> film = work.film;
    result->planned = work.planned;
    if (!film) {
        result->film = std::make_shared<Film>(work.window, work.display_width, work.display_height);
        film = result->film;
        result->planned =
            std::make_shared<const std::vector<std::uint32_t>>(film->pixel_count(), 0);
    }
    const std::vector<std::uint32_t>& first = *result->planned;
    Plan plan =
        work.planner->NextPass({*film, work.budget, first, work.guide ? &work.guide : nullptr});
    result->reason = std::move(plan.reason);
    result->selector = std::move(plan.selector);
    result->decisions = std::move(plan.decisions);
    if (plan.counts.empty()) {
        return;
    }
    std::uint64_t total = 0;
    for (const std::uint32_t count : plan.counts) {
        total += count;
    }
    if (plan.counts.size() != first.size() || total == 0 || total > work.budget) {
        throw Error(ErrorCode::kInternal,
                    fmt::format("sampler planned {} samples for {} of {} pixels with {} left",
                                total, plan.counts.size(), first.size(), work.budget));
    }
    std::vector<std::uint32_t> cover;
    if (work.planner->View() == FilmView::kLagging && total < work.budget) {
        cover = CutCover(work.window, work.pass, first, plan.counts);
    }
    result->pass = std::make_shared<Pass>(work.window, work.tile_size, first,
                                          std::move(plan.counts), std::move(cover));
    result->planned = std::make_shared<const std::vector<std::uint32_t>>(result->pass->NextFirst());
}

}  // namespace

PlanResult RunPlan(const PlanWork& work) {
    const SteadyClock clock;
    const TimePoint start = clock.Now();
    PlanResult result;
    try {
        MakePlan(work, &result);
    } catch (const std::bad_alloc&) {
        result.failure = fmt::format(
            "the server ran out of memory while it planned a pass of {}x{} pixels; choose a "
            "smaller --size or --crop",
            work.window.width(), work.window.height());
    } catch (const std::exception& error) {
        result.failure = error.what();
    }
    result.seconds = ToSeconds(clock.Now() - start);
    return result;
}

}  // namespace relume::jobs
