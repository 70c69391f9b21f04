#include <fmt/format.h>

#include <algorithm>

#include "core/base/error.h"
#include "server/jobs/job_queue.h"

// Of JobQueue: which jobs are served, and in which order; what clients change of that.
namespace relume::jobs {
namespace {

// A worker's threads stay with one owner's jobs for about so long, though others are behind.
constexpr double kStaySeconds = 5;
// Of a sample, by one core, as long as nothing is measured.
constexpr double kAssumedSampleSeconds = 1e-6;
constexpr const char* kNoRoom =
    "waits for memory: it starts when jobs under way have ended (relume-server --film-memory)";

}  // namespace

// Call when a job may have come to be another.
void JobQueue::Place(Job* job) {
    const std::uint64_t number = job->info().number;
    if (job->active()) {
        active_[number] = job;
    } else {
        active_.erase(number);
    }
    if (room_.Put(number, job->takes_memory() ? job->memory() : 0)) {
        news_ = true;  // for those that wait for it
    }
    if (job->running()) {
        share_.Put(number, KeyOf(*job), job->info().state != JobState::kQueued);
    } else {
        share_.Remove(number);
    }
}

void JobQueue::SetSlack() {
    double threads = 0;
    for (const auto& [id, worker] : workers_) {
        threads += worker.info.threads;
    }
    share_.SetSlack(kStaySeconds * threads /
                    static_cast<double>(std::max<std::size_t>(workers_.size(), 1)));
}

FairShare::Charge JobQueue::ChargeFor(const Job& job, std::uint64_t samples) {
    const JobInfo& info = job.info();
    const double each = info.samples_done > 0 && info.busy_seconds > 0
                            ? info.busy_seconds / static_cast<double>(info.samples_done)
                            : kAssumedSampleSeconds;
    return {KeyOf(job), std::min(each * static_cast<double>(samples), kMaxPredictedSeconds)};
}

// A job takes much memory once it is started: an owner's next one is not, while it has one that
// goes on, unless nobody has anything else for this worker; nor while another one is starting.
std::optional<LeaseGrant> JobQueue::LendFirst(WorkerId id, TimePoint now) {
    const FairShare::Key* last = workers_.at(id).last ? &*workers_.at(id).last : nullptr;
    std::optional<LeaseGrant> grant;
    const auto may_start = [&] {
        const auto it = by_number_.find(starting_);
        return it == by_number_.end() || !it->second->starting();
    };
    const auto start = [&](const FairShare::Jobs& jobs) {
        if (jobs.waiting.empty() || !may_start()) {
            return false;
        }
        Job* job = by_number_.at(*jobs.waiting.begin());
        if (!room_.Has(job->memory())) {
            job->Wait(kNoRoom, now);
            return false;
        }
        starting_ = job->info().number;
        grant = Lend(id, job, now);
        return grant.has_value();
    };
    const auto lend = [&](const FairShare::Jobs& jobs) {
        for (const std::uint64_t number : jobs.started) {
            grant = Lend(id, by_number_.at(number), now);
            if (grant) {
                return true;
            }
        }
        return jobs.started.empty() && start(jobs);
    };
    if (!share_.Each(last, lend)) {
        share_.Each(last, start);
    }
    return grant;
}

std::optional<LeaseGrant> JobQueue::RaceFirst(WorkerId id, TimePoint now) {
    const Worker& worker = workers_.at(id);
    std::optional<LeaseGrant> grant;
    share_.Each(nullptr, [&](const FairShare::Jobs& jobs) {
        for (const std::uint64_t number : jobs.started) {
            Job* job = by_number_.at(number);
            if (MayWorkOn(worker, job, now)) {
                if (const auto unit = FindRace(id, worker, *job, now)) {
                    grant = Issue(id, job, *unit, now);
                    return true;
                }
            }
        }
        return false;
    });
    return grant;
}

void JobQueue::Pause(const std::string& name, TimePoint now) {
    Job& job = Find(name);
    job.Pause(now);
    NoteStateOf(&job);
}

void JobQueue::Resume(const std::string& name, TimePoint now) {
    Job& job = Find(name);
    job.Resume(now);
    NoteStateOf(&job);
    news_ = true;
}

void JobQueue::SetPriority(const std::string& name, int priority, TimePoint now) {
    if (priority < kMinPriority || priority > kMaxPriority) {
        ThrowInvalidArgument(
            fmt::format("priority {}: must be {} to {}", priority, kMinPriority, kMaxPriority));
    }
    Job& job = Find(name);
    job.SetPriority(priority, now);
    NoteStateOf(&job);
}

std::optional<double> JobQueue::ShareOf(const std::string& name, TimePoint now) const {
    const Job& job = Find(name);
    return job.running() ? std::optional(share_.Share(job.info().number, now)) : std::nullopt;
}

}  // namespace relume::jobs
