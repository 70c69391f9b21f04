#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "server/jobs/queue_status.h"

namespace relume::metrics {

// What people call a job, and how it is made.
struct JobText {
    std::string title, sampler, filter;  // the latter two with or without parameters
    std::string owner;
    int priority = 0;
};

// The farm at one moment. Bytes are since the server's start.
struct FarmStatus {
    jobs::QueueStatus queue;
    std::vector<JobText> job_texts;  // of queue.under_way, one each
    std::uint64_t blobs_in = 0, blobs_out = 0, results_out = 0, work_in = 0, work_out = 0;
    std::uint64_t blob_bytes = 0, blob_quota = 0;                    // of the store
    std::vector<std::pair<std::string, std::size_t>> tasks_waiting;  // by thread of the server
};

}  // namespace relume::metrics
