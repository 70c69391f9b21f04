#pragma once

#include <cstdint>
#include <string>

#include "core/film/tile.h"
#include "server/jobs/job_info.h"

namespace relume::jobs {

// Adds an answer of `samples` samples to what is known of its job (sign 1), or takes it out again
// (-1).
void CountAnswer(const std::string& worker, std::uint64_t samples, const TileResult& result,
                 int sign, JobInfo* info);

}  // namespace relume::jobs
