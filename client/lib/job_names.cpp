#include "client/lib/job_names.h"

#include <fmt/format.h>

#include <cstdint>
#include <random>

namespace relume::client {

std::string JobName(const std::string& text) {
    return text.rfind("jobs/", 0) == 0 ? text : "jobs/" + text;
}

bool IsOver(v1::JobState state) {
    return state == v1::JOB_STATE_SUCCEEDED || state == v1::JOB_STATE_FAILED ||
           state == v1::JOB_STATE_CANCELLED;
}

std::string StateName(v1::JobState state) {
    switch (state) {
        case v1::JOB_STATE_QUEUED:
            return "queued";
        case v1::JOB_STATE_RENDERING:
            return "rendering";
        case v1::JOB_STATE_FILTERING:
            return "filtering";
        case v1::JOB_STATE_SUCCEEDED:
            return "succeeded";
        case v1::JOB_STATE_FAILED:
            return "failed";
        case v1::JOB_STATE_CANCELLED:
            return "cancelled";
        default:
            return "unknown";
    }
}

std::string StateText(const v1::Job& job) {
    if (!IsOver(job.state()) && job.stop_reason() == v1::STOP_REASON_CANCELLED) {
        return "cancelling";
    }
    return job.paused() ? "paused" : StateName(job.state());
}

std::string StopReasonName(v1::StopReason reason) {
    switch (reason) {
        case v1::STOP_REASON_SPP:
            return "spp";
        case v1::STOP_REASON_TARGET:
            return "target";
        case v1::STOP_REASON_TIME_LIMIT:
            return "time-limit";
        case v1::STOP_REASON_MAX_SPP:
            return "max-spp";
        case v1::STOP_REASON_SAMPLER:
            return "sampler";
        case v1::STOP_REASON_CANCELLED:
            return "cancelled";
        default:
            return "";
    }
}

std::string MakeRequestId() {
    std::random_device device;
    std::uint64_t high = (std::uint64_t{device()} << 32) | device();
    std::uint64_t low = (std::uint64_t{device()} << 32) | device();
    high = (high & ~std::uint64_t{0xf000}) | 0x4000;                     // version 4
    low = (low & ~(std::uint64_t{3} << 62)) | (std::uint64_t{2} << 62);  // variant of RFC 4122
    return fmt::format("{:08x}-{:04x}-{:04x}-{:04x}-{:012x}", high >> 32, (high >> 16) & 0xffff,
                       high & 0xffff, low >> 48, low & 0xffffffffffff);
}

}  // namespace relume::client
