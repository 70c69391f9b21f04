#include "core/base/memory.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace relume {

std::uint64_t MachineMemory() {
    std::uint64_t bytes = static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
                          static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    // "max", which is no number, where there is no limit.
    std::uint64_t limit = 0;
    if (std::ifstream("/sys/fs/cgroup/memory.max") >> limit && limit > 0) {
        bytes = std::min(bytes, limit);
    }
    return bytes;
}

}  // namespace relume
