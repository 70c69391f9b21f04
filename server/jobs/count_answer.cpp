#include "server/jobs/count_answer.h"

#include "core/film/aov.h"

namespace relume::jobs {

void CountAnswer(const std::string& worker, std::uint64_t samples, const TileResult& result,
                 int sign, JobInfo* info) {
    const auto add = [sign](std::uint64_t count, std::uint64_t* sum) {
        *sum += sign > 0 ? count : -count;
    };
    add(samples, &info->samples_done);
    add(result.rays, &info->rays);
    for (std::size_t k = 0; k < result.pixels.size(); ++k) {
        add(static_cast<std::uint64_t>(result.planes[kBadCount * result.pixels.size() + k]),
            &info->bad_samples);
    }
    WorkerShare& share = info->workers[worker];
    add(samples, &share.samples);
    add(1, &share.leases);
    share.busy_seconds += sign * result.seconds;
    info->busy_seconds += sign * result.seconds;
}

}  // namespace relume::jobs
