#pragma once

#include <cstdint>

namespace relume {

// What server and workers must agree on. A worker of another version is refused at its Hello.
inline constexpr std::uint32_t kProtocolVersion = 3;

// Welcome.report_seconds: a worker that is silent for much longer is taken for stuck.
inline constexpr double kReportSeconds = 1.0;

// NumericClass.build: bits are promised within one build alone.
inline constexpr const char* kBuild = "relume 0.1.0";

}  // namespace relume
