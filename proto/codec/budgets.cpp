#include "proto/codec/budgets.h"

#include <fmt/format.h>

#include "core/base/error.h"

namespace relume::codec {
namespace {

void CheckRange(const char* name, double value, double most) {
    if (!(value > 0) || value > most) {
        ThrowInvalidArgument(
            fmt::format("{} {}: must be above 0 and at most {:.0f}", name, value, most));
    }
}

}  // namespace

void CheckBudgets(const v1::JobSpec& spec) {
    if (spec.spp() != 0) {  // NaN is not
        CheckRange("spp", spec.spp(), kMaxSpp);
    }
    if (spec.has_min_spp()) {
        CheckRange("min-spp", spec.min_spp(), kMaxSpp);
    }
    if (spec.has_max_spp()) {
        CheckRange("max-spp", spec.max_spp(), kMaxSpp);
    }
    if (spec.has_target()) {
        CheckRange("target", spec.target(), kMaxTarget);
    }
    if (spec.has_time_limit()) {
        CheckRange("time-limit", spec.time_limit(), kMaxTimeLimit);
    }
    if (spec.spp() == 0 && !spec.has_max_spp() && !spec.has_target() && !spec.has_time_limit()) {
        ThrowInvalidArgument(
            "spp 0: the job has no budget; set spp, max-spp, target or time-limit");
    }
    if (spec.has_max_spp() && spec.min_spp() > spec.max_spp()) {
        ThrowInvalidArgument(
            fmt::format("min-spp {} is more than max-spp {}; lower the one or "
                        "raise the other",
                        spec.min_spp(), spec.max_spp()));
    }
    if (spec.spp() != 0 && spec.min_spp() > spec.spp()) {
        ThrowInvalidArgument(fmt::format(
            "min-spp {} is more than spp {}, the mean; lower the one or raise the other",
            spec.min_spp(), spec.spp()));
    }
}

}  // namespace relume::codec
