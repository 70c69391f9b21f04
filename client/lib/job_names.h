#pragma once

#include <string>

#include "relume/v1/jobs.pb.h"

namespace relume::client {

// "jobs/7f3a" of "7f3a" or "jobs/7f3a".
std::string JobName(const std::string& text);

// True once nothing more will happen to the job.
bool IsOver(v1::JobState state);
// "rendering", "succeeded", ...
std::string StateName(v1::JobState state);

// The same, but "paused" and "cancelling" of a job that is.
std::string StateText(const v1::Job& job);

// "spp", "target", "time-limit", "max-spp", "sampler", "cancelled"; "" if it has not stopped.
std::string StopReasonName(v1::StopReason reason);

// A random UUID of version 4.
std::string MakeRequestId();

}  // namespace relume::client
