#pragma once

#include <cstddef>
#include <cstdint>

namespace relume::server {

// How much of the server clients may take; see docs/operations.md.
struct Quotas {
    std::size_t client_jobs = 1000;     // of one client, not over
    std::size_t jobs = 10'000;          // of all, not over
    std::size_t client_streams = 1024;  // open, of one address
    std::int64_t pixels = 1 << 26;      // of one image
    std::uint64_t film_memory = 0;      // bytes of all films under way; 0: half of this machine's
};

}  // namespace relume::server
