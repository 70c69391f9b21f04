#include "server/jobs/event_log.h"

#include <algorithm>

namespace relume::jobs {

void EventLog::Append(const JobInfo& job) {
    events_.push_back({++last_, std::make_shared<const JobInfo>(job)});
    Trim(capacity_);
}

std::optional<JobEvent> EventLog::Find(std::uint64_t from) const {
    if (events_.empty() || from > last_) {
        return std::nullopt;
    }
    const std::uint64_t first = events_.front().number;
    return events_[static_cast<std::size_t>(std::max(from, first) - first)];
}

void EventLog::Trim(std::size_t count) {
    while (events_.size() > count) {
        events_.pop_front();
    }
}

}  // namespace relume::jobs
