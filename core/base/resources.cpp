#include "core/base/resources.h"

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <utility>

#include "core/base/error.h"

namespace relume {
namespace {

namespace fs = std::filesystem;

// The first words of a file, as numbers; nothing for "max", a file that is not there, and the like.
std::optional<double> ReadNumber(const fs::path& path, int word = 0) {
    std::ifstream file(path);
    std::string text;
    for (int i = 0; i <= word; ++i) {
        file >> text;
    }
    std::istringstream in(text);
    double number = 0;
    return file && in >> number && in.eof() ? std::optional(number) : std::nullopt;
}

template <typename T>
void Lower(std::optional<T>* least, T value) {
    *least = std::min(least->value_or(value), value);
}

// Of one group, by the files of both versions.
void ReadGroup(const fs::path& group, GroupLimits* limits) {
    for (const auto& [quota, period] :
         {std::pair(ReadNumber(group / "cpu.max"), ReadNumber(group / "cpu.max", 1)),
          std::pair(ReadNumber(group / "cpu.cfs_quota_us"),
                    ReadNumber(group / "cpu.cfs_period_us"))}) {
        if (quota && period && *quota > 0 && *period > 0) {
            Lower(&limits->cores, *quota / *period);
        }
    }
    for (const char* file : {"memory.max", "memory.limit_in_bytes"}) {
        // Version 1 says "no limit" by a number near 2^63.
        if (const auto bytes = ReadNumber(group / file); bytes && *bytes < 0x1p60) {
            Lower(&limits->memory, static_cast<std::uint64_t>(*bytes));
        }
    }
}

int AffineCores() {
    cpu_set_t set;
    CPU_ZERO(&set);
    // More processors than a set holds: all of them.
    return sched_getaffinity(0, sizeof set, &set) == 0
               ? CPU_COUNT(&set)
               : static_cast<int>(std::thread::hardware_concurrency());
}

}  // namespace

GroupLimits ReadGroupLimits(const fs::path& membership, const fs::path& root) {
    GroupLimits limits;
    std::ifstream file(membership);
    for (std::string line; std::getline(file, line);) {
        // "0::/path", or in version 1 "4:cpu,cpuacct:/path", mounted as root/cpu,cpuacct.
        const std::size_t first = line.find(':');
        const std::size_t second = first == std::string::npos ? first : line.find(':', first + 1);
        if (second == std::string::npos) {
            continue;
        }
        const fs::path mount = root / line.substr(first + 1, second - first - 1);
        fs::path group = fs::path(line.substr(second + 1)).relative_path().lexically_normal();
        // In a container the path may be the one outside: then the mount is the group itself.
        for (;; group = group.parent_path()) {
            ReadGroup(mount / group, &limits);
            if (group.empty() || group == ".") {
                break;
            }
        }
    }
    return limits;
}

Resources AvailableResources() {
    Resources resources;
    const GroupLimits limits = ReadGroupLimits("/proc/self/cgroup", "/sys/fs/cgroup");
    resources.cores = std::max(1, AffineCores());
    if (limits.cores) {
        resources.cores =
            std::clamp(static_cast<int>(std::ceil(*limits.cores)), 1, resources.cores);
    }
    const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    if (pages > 0 && page > 0) {
        resources.memory = static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page);
    }
    resources.memory = std::min(resources.memory, limits.memory.value_or(resources.memory));
    return resources;
}

void LimitData(std::uint64_t bytes) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    static_cast<void>(bytes);
#else
    rlimit limit{};
    getrlimit(RLIMIT_DATA, &limit);
    limit.rlim_cur = std::min<rlim_t>(bytes, limit.rlim_max);
    if (setrlimit(RLIMIT_DATA, &limit) != 0) {
        throw Error(ErrorCode::kInternal, "can't limit the memory of this process");
    }
#endif
}

std::optional<std::uint64_t> DataLimit() {
    rlimit limit{};
    if (getrlimit(RLIMIT_DATA, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) {
        return std::nullopt;
    }
    return limit.rlim_cur;
}

}  // namespace relume
