#pragma once

#include <atomic>
#include <cstdint>

namespace relume::server {

// Bytes since the start, without what gRPC adds.
struct Traffic {
    std::atomic<std::uint64_t> blobs_in{0}, blobs_out{0}, results_out{0};
    std::atomic<std::uint64_t> work_in{0}, work_out{0};  // messages of and to workers
};

}  // namespace relume::server
