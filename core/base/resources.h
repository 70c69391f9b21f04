#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>

namespace relume {

// What a process may take of its machine.
struct Resources {
    int cores = 1;  // that it may run on, a share of one rounded up
    std::uint64_t memory = std::numeric_limits<std::uint64_t>::max();  // bytes
};

// Of this process: the cores that its affinity leaves it, and the machine's memory, both as far as
// control groups (a container's limits, version 2 or 1) allow.
Resources AvailableResources();

// The least that the control groups of a process allow, itself and all above it. `membership`: what
// /proc/self/cgroup says; `root`: where control groups are mounted. What is not limited, or can't
// be read, is unset.
struct GroupLimits {
    std::optional<double> cores;
    std::optional<std::uint64_t> memory;
};
GroupLimits ReadGroupLimits(const std::filesystem::path& membership,
                            const std::filesystem::path& root);

// From now on this process can't have more than `bytes` of data: heap, stacks of threads and other
// memory of its own. Asking for more fails (std::bad_alloc). Nothing happens in builds with a
// sanitizer, whose own data is larger than any machine.
void LimitData(std::uint64_t bytes);
// What LimitData, or whoever started this process, has set.
std::optional<std::uint64_t> DataLimit();

}  // namespace relume
