#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/base/cancel_token.h"
#include "core/film/film.h"
#include "server/jobs/job_info.h"
#include "server/rpc/job_spec.h"

namespace relume::server {

// A job's result.
struct FinishedImage {
    std::string exr;  // the file's bytes
    jobs::Outcome outcome;
};

// Filters the film, assembles the layers and encodes the file. Pure: no job's name and no time goes
// into it, so that two renders of one spec give the same file. Throws kCancelled soon after
// `cancel` is set.
FinishedImage FinishImage(const Film& film, const CheckedSpec& spec,
                          const std::string& numeric_class, const CancelToken& cancel);

// The film's EstimateRelMSE and half the width of its 95 % interval, pixels taken for independent.
struct ErrorEstimate {
    double relmse = 0, margin = 0;
};
ErrorEstimate EstimateError(const Film& film);

}  // namespace relume::server
