#include "server/jobs/memory_room.h"

namespace relume::jobs {

bool MemoryRoom::Put(std::uint64_t job, std::uint64_t bytes) {
    std::uint64_t& of = of_[job];
    const bool less = bytes < of;
    taken_ += bytes - of;
    of = bytes;
    if (bytes == 0) {
        of_.erase(job);
    }
    return less;
}

}  // namespace relume::jobs
