#pragma once

#include <prometheus/metric_family.h>

#include <optional>
#include <vector>

#include "server/metrics/farm_status.h"

namespace relume::metrics {

// The status as Prometheus' families, sorted as docs/operations.md lists them. Without a status
// (the coordinator does not answer) only relume_build_info and relume_coordinator_responding.
std::vector<prometheus::MetricFamily> MakeFamilies(const std::optional<FarmStatus>& status);

}  // namespace relume::metrics
