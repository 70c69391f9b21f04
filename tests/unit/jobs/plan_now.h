#pragma once

#include "server/jobs/job_queue.h"

namespace relume::jobs {

// Does the plan work that waits; false if there is none.
inline bool PlanNow(JobQueue* queue, TimePoint now) {
    bool any = false;
    while (const auto work = queue->TakePlanWork(now)) {
        queue->Planned(work->name, RunPlan(*work), now);
        any = true;
    }
    return any;
}

}  // namespace relume::jobs
