#pragma once

#include <spdlog/spdlog.h>

#include <string>

namespace relume {

// Sets up spdlog's default logger: to stderr, one line an event, or JSON lines for machines.
// `process` names the program in every line. `level` is trace, debug, info, warn, error or off;
// anything else throws kInvalidArgument. Call once at the start of main().
void InitLogging(const std::string& process, const std::string& level, bool json);

}  // namespace relume
