#pragma once

#include <chrono>
#include <string>

#include "relume/v1/jobs.pb.h"
#include "server/jobs/job_info.h"

namespace relume::server {

// Turns monotonic times into the time of day, by one reading of both clocks at the start.
class WallClock {
  public:
    explicit WallClock(TimePoint now)
        : offset_(std::chrono::system_clock::now().time_since_epoch() - now.time_since_epoch()) {}
    std::chrono::system_clock::time_point At(TimePoint t) const {
        return std::chrono::system_clock::time_point(
            std::chrono::duration_cast<std::chrono::system_clock::duration>(t.time_since_epoch() +
                                                                            offset_));
    }

    TimePoint Of(std::chrono::system_clock::time_point t) const {
        return TimePoint(std::chrono::duration_cast<Duration>(t.time_since_epoch() - offset_));
    }

  private:
    std::chrono::nanoseconds offset_;
};

// All but `spec` and `scene_sha256`, which JobInfo does not know.
void InfoToProto(const jobs::JobInfo& info, const WallClock& wall, v1::Job* job);

// A worker's class as JobQueue compares it.
std::string NumericClassText(const v1::NumericClass& numeric_class);

void WorkerToProto(const jobs::WorkerInfo& info, const WallClock& wall, v1::Worker* worker);

}  // namespace relume::server
