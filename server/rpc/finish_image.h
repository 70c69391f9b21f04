#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/base/cancel_token.h"
#include "core/film/film.h"
#include "server/jobs/job_queue.h"
#include "server/rpc/job_spec.h"

namespace relume::server {

// A job's result.
struct FinishedImage {
    std::string exr;         // the file's bytes
    std::string exr_sha256;  // "": not asked for yet
    jobs::Outcome outcome;
};

// Filters the film, assembles the layers and encodes the file. With all layers, and if the sampler
// has them, also selector.Y, the number that decided whether a pixel gets more samples, and
// decision.Y: 0 converged, 1 sampled on, 2 at the most samples a pixel may have. Pure: no job's
// name and no time goes into it, so that two renders of one spec give the same file. Throws
// kCancelled soon after `cancel` is set.
FinishedImage FinishImage(const jobs::JobQueue::FilterWork& work, const CheckedSpec& spec,
                          const std::string& numeric_class, const CancelToken& cancel);

}  // namespace relume::server
