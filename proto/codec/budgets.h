#pragma once

#include "relume/v1/jobs.pb.h"

namespace relume::codec {

inline constexpr double kMaxSpp = 1 << 20;             // mean, least and most samples a pixel
inline constexpr double kMaxTarget = 1000;             // RelMSE
inline constexpr double kMaxTimeLimit = 30 * 86400.0;  // seconds

// Throws kInvalidArgument unless at least one budget of the job is set, all are within their ranges
// and none excludes another.
void CheckBudgets(const v1::JobSpec& spec);

}  // namespace relume::codec
