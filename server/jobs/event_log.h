#pragma once

#include <deque>
#include <optional>

#include "server/jobs/job_info.h"

namespace relume::jobs {

// The latest events of one job, numbered from `last` + 1.
class EventLog {
  public:
    explicit EventLog(std::size_t capacity, std::uint64_t last = 0)
        : capacity_(capacity), last_(last) {}

    void Append(const JobInfo& job);
    // The first kept event with a number of at least `from`.
    std::optional<JobEvent> Find(std::uint64_t from) const;
    std::uint64_t last() const { return last_; }
    // Forgets all but the newest `count`.
    void Trim(std::size_t count);

  private:
    std::size_t capacity_;
    std::uint64_t last_;
    std::deque<JobEvent> events_;
};

}  // namespace relume::jobs
