#include "bench/farm/process_figures.h"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <string>

#include "core/base/error.h"

namespace relume::bench {

ProcessFigures FiguresOf(pid_t pid) {
    ProcessFigures figures;
    std::ifstream stat(fmt::format("/proc/{}/stat", pid));
    std::string line;
    if (!std::getline(stat, line)) {
        throw Error(ErrorCode::kNotFound, fmt::format("there is no process {}", pid));
    }
    // Fields from the third on; the second, in brackets, may hold anything.
    std::istringstream fields(line.substr(line.rfind(')') + 2));
    std::string skipped;
    for (int field = 3; field < 14; ++field) {
        fields >> skipped;
    }
    double user = 0, system = 0;
    fields >> user >> system;
    const auto ticks = static_cast<double>(sysconf(_SC_CLK_TCK));
    figures.user = user / ticks;
    figures.system = system / ticks;

    std::ifstream status(fmt::format("/proc/{}/status", pid));
    while (std::getline(status, line)) {
        std::istringstream words(line);
        std::string key;
        std::size_t kib = 0;
        words >> key >> kib;
        if (key == "VmRSS:") {
            figures.resident = kib << 10;
        } else if (key == "VmHWM:") {
            figures.peak = kib << 10;
        }
    }
    return figures;
}

}  // namespace relume::bench
