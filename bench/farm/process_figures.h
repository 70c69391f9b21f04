#pragma once

#include <sys/types.h>

#include <cstddef>

namespace relume::bench {

// What the kernel says of a process on this machine.
struct ProcessFigures {
    double user = 0, system = 0;         // CPU seconds of all its threads so far
    std::size_t resident = 0, peak = 0;  // bytes
};

// Throws if there is no such process.
ProcessFigures FiguresOf(pid_t pid);

}  // namespace relume::bench
