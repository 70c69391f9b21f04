#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "core/film/film.h"
#include "core/film/tile.h"
#include "server/jobs/job.h"
#include "server/jobs/job_info.h"
#include "server/jobs/planner.h"

namespace relume::test {

// What a farm of one worker makes of a job.
struct Sampled {
    std::shared_ptr<const Film> film;
    jobs::JobInfo info;
};

// Runs a job over `window`, the whole picture, to its end on this thread: the same Job, plans and
// merges that the server has. `setup` says what it is made of, but for its window. `answer` is the
// worker. Throws kInternal if the job fails.
Sampled RunJob(const TileRect& window, jobs::JobSetup setup,
               const std::function<TileResult(const TileTask&)>& answer);

// One of `budget` samples. An empty guide: the image is not filtered.
Sampled RunJob(const TileRect& window, std::shared_ptr<jobs::Planner> planner, std::uint64_t budget,
               const jobs::Guide& guide, const std::function<TileResult(const TileTask&)>& answer);

}  // namespace relume::test
