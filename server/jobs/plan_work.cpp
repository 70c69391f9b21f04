#include "server/jobs/plan_work.h"

#include <fmt/format.h>

#include <exception>
#include <new>
#include <utility>

#include "core/base/clock.h"
#include "server/jobs/cover.h"

namespace relume::jobs {
namespace {

void MakePlan(const PlanWork& work, const Clock& clock, TimePoint start, PlanResult* result) {
    std::shared_ptr<const Film> film = work.film;
    result->planned = work.planned;
    if (!film) {
        result->film = std::make_shared<Film>(work.window, work.display_width, work.display_height);
        film = result->film;
        result->planned =
            std::make_shared<const std::vector<std::uint32_t>>(film->pixel_count(), 0);
    }
    const std::vector<std::uint32_t>& first = *result->planned;
    BudgetedPlanner::Pass pass = work.planner->NextPass(
        {*film, first, work.guide ? &work.guide : nullptr, work.samples_done,
         work.samples_per_second, [&] { return work.seconds + ToSeconds(clock.Now() - start); },
         work.rays});
    result->stop = std::move(pass.stop);
    result->last = pass.last;
    result->error = pass.error;
    result->expected_error = pass.expected_error;
    result->finish_seconds = pass.finish_seconds;
    result->filter_seconds = pass.filter_seconds;
    result->selector = std::move(pass.plan.selector);
    result->decisions = std::move(pass.plan.decisions);
    if (result->stop) {
        return;
    }
    std::vector<std::uint32_t> cover;
    if (work.planner->View() == FilmView::kLagging && !pass.last) {
        cover = CutCover(work.window, work.pass, first, pass.plan.counts);
    }
    result->pass = std::make_shared<Pass>(work.window, work.tile_size, first,
                                          std::move(pass.plan.counts), std::move(cover));
    result->planned = std::make_shared<const std::vector<std::uint32_t>>(result->pass->NextFirst());
}

}  // namespace

PlanResult RunPlan(const PlanWork& work) {
    const SteadyClock clock;
    const TimePoint start = clock.Now();
    PlanResult result;
    try {
        MakePlan(work, clock, start, &result);
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
