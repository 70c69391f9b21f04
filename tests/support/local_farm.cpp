#include "tests/support/local_farm.h"

#include <utility>

#include "core/base/error.h"
#include "server/jobs/plan_work.h"

namespace relume::test {

Sampled RunJob(const TileRect& window, jobs::JobSetup setup,
               const std::function<TileResult(const TileTask&)>& answer) {
    setup.window = window;
    setup.display_width = window.width();
    setup.display_height = window.height();
    const TimePoint now{};
    jobs::Job job("jobs/local", 1, std::move(setup), now);
    job.Start(now);
    for (;;) {
        if (const auto work = job.TakePlanWork(now)) {
            job.Planned(jobs::RunPlan(*work), now);
        } else if (const auto unit = job.FindPending(0, [](std::size_t) { return true; })) {
            job.Take(*unit);
            job.AddLease(*unit, 1, now);
            job.DropLease(*unit, 1);
            job.Accept(*unit, "local", answer(job.Task(*unit)), now);
        } else {
            break;
        }
    }
    Sampled out{nullptr, job.info()};
    auto sampled = job.TakeSampled();
    if (!sampled) {
        throw Error(ErrorCode::kInternal, "the job failed: " + job.info().message);
    }
    out.film = sampled->film;
    return out;
}

Sampled RunJob(const TileRect& window, std::shared_ptr<jobs::Planner> planner, std::uint64_t budget,
               const jobs::Guide& guide, const std::function<TileResult(const TileTask&)>& answer) {
    jobs::JobSetup setup;
    setup.budgets.samples = budget;
    setup.planner = std::move(planner);
    setup.guide = guide;
    return RunJob(window, std::move(setup), answer);
}

}  // namespace relume::test
