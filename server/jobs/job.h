#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/film/film.h"
#include "server/jobs/event_log.h"
#include "server/jobs/job_info.h"
#include "server/jobs/pass.h"
#include "server/jobs/planner.h"

namespace relume::jobs {

using WorkerId = std::uint64_t;  // from 1
using LeaseId = std::uint64_t;   // from 1

// What a job is to be made of.
struct JobSetup {
    TileRect window;
    int display_width = 0, display_height = 0;
    int tile_size = 32;
    std::uint64_t budget = 0;  // samples
    std::unique_ptr<Planner> planner;
};

// One job: its film, the pass it is at, and which units of that are lent, wait or are done. It
// knows leases and workers by number only; JobQueue decides who gets what. Not thread-safe.
class Job {
  public:
    Job(const std::string& name, std::uint64_t number, JobSetup setup, TimePoint now);

    const JobInfo& info() const { return info_; }
    const EventLog& events() const { return events_; }
    bool active() const {
        return info_.state == JobState::kQueued || info_.state == JobState::kRendering;
    }
    const Pass& pass() const { return *pass_; }

    // Makes the film and plans the first pass, on the first call alone; the film's memory is not
    // taken before. A failure ends the job. False: there is nothing to render.
    bool Start(TimePoint now);

    // Takes the first waiting unit for which `wanted` says yes.
    std::optional<std::size_t> TakePending(const std::function<bool(std::size_t)>& wanted);
    // Records a lease on the unit and counts it.
    void AddLease(std::size_t unit, LeaseId lease, TimePoint now);
    void DropLease(std::size_t unit, LeaseId lease) { units_[unit].leases.erase(lease); }
    // The unit waits again. Answers to leases that are out on it are still welcome.
    void Requeue(std::size_t unit);
    const std::set<LeaseId>& Leases(std::size_t unit) const { return units_[unit].leases; }

    // Notes that `worker` gave a wrong answer to the unit; how many it has had by now.
    int Refuse(std::size_t unit, WorkerId worker);
    bool Refused(std::size_t unit, WorkerId worker) const {
        return units_[unit].refused.count(worker) != 0;
    }

    // Merges the checked answer to a unit that is not done. Plans the next pass when it was the
    // last.
    void Accept(std::size_t unit, const std::string& worker, TileResult result, TimePoint now);
    // True if units came to wait since the last call: there is work for those who are idle.
    bool TakeNewWork() { return std::exchange(new_work_, false); }

    void CountDuplicate() { ++info_.results_duplicate; }
    void SetNumericClass(const std::string& numeric_class) { info_.numeric_class = numeric_class; }
    // Kept once each.
    void AddNote(const std::string& note, TimePoint now);

    // The film of a job that has come to FILTERING, once.
    std::shared_ptr<const Film> TakeFilm();
    // Ends the job, unless it is over.
    void Succeed(Outcome outcome, TimePoint now);
    void Fail(const std::string& message, TimePoint now) { End(JobState::kFailed, message, now); }
    void Cancel(TimePoint now) { End(JobState::kCancelled, "cancelled", now); }

  private:
    struct Unit {
        std::set<LeaseId> leases;    // that may still be answered
        std::set<WorkerId> refused;  // gave wrong answers
        int bad = 0;
        bool pending = true;  // in pending_
        bool issued = false;  // at least once
    };

    void PlanPass(TimePoint now);
    void EndPass(TimePoint now);
    void End(JobState state, const std::string& message, TimePoint now);
    void Publish(TimePoint now);

    JobSetup setup_;
    JobInfo info_;
    EventLog events_;
    TimePoint last_publish_;

    std::shared_ptr<Film> film_;
    std::optional<Pass> pass_;
    std::vector<Unit> units_;           // of pass_
    std::deque<std::size_t> pending_;   // units to be lent, first ones first; done ones are skipped
    std::vector<std::uint32_t> first_;  // index of each pixel's next sample
    std::uint64_t planned_samples_ = 0;
    std::optional<TimePoint> first_lease_;
    TimePoint pass_start_;
    bool new_work_ = false;
};

}  // namespace relume::jobs
