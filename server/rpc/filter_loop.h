#pragma once

#include <memory>
#include <string>

#include "server/jobs/planner.h"

namespace relume::server {

// The filter in the sampler's loop: where the two filtered halves of a film disagree
// (denoise/halves.h). `filter` is a job's; "none" has no loop: an empty Guide.
jobs::Guide MakeGuide(const std::string& filter);

}  // namespace relume::server
