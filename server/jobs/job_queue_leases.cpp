#include <algorithm>
#include <utility>

#include "core/base/log.h"
#include "server/jobs/job_queue.h"

// The table of leases of JobQueue: losses, revocations, lateness. Invariant: each lease in it is on
// a unit of its job's open passes that is not done. Lending: job_queue_lending.cpp; answers:
// job_queue_results.cpp.
namespace relume::jobs {
namespace {

constexpr double kMaxTickGap = 5;  // seconds; a longer one is the server's own absence

}  // namespace

bool JobQueue::Holds(WorkerId worker, const Job& job, std::size_t unit) const {
    const auto& holders = job.Leases(unit);
    return std::any_of(holders.begin(), holders.end(), [&](LeaseId holder) {
        const Lease& lease = leases_.at(holder);
        return lease.worker == worker && !lease.abandoned;
    });
}

void JobQueue::RequeueIfLate(Job* job, std::size_t unit) {
    const auto& holders = job->Leases(unit);
    if (std::all_of(holders.begin(), holders.end(),
                    [&](LeaseId holder) { return leases_.at(holder).late; })) {
        job->Requeue(unit);
        news_ = job->TakeNewWork() || news_;
    }
}

void JobQueue::Abandon(LeaseId id, Lease* lease) {
    Worker& worker = workers_.at(lease->worker);
    worker.leases.erase(id);
    worker.samples_out -= lease->samples;
    share_.Return(lease->charge);
    lease->late = lease->abandoned = true;
}

void JobQueue::Forget(Leases::iterator it) {
    if (!it->second.abandoned) {
        Abandon(it->first, &it->second);
    }
    leases_.erase(it);
}

void JobQueue::GiveBack(Leases::iterator it) {
    Job& job = Find(it->second.job);
    const std::size_t unit = it->second.unit;
    job.DropLease(unit, it->first);
    Forget(it);
    RequeueIfLate(&job, unit);
    // While nothing is merged, whoever comes next may set the class.
    if (job.info().samples_done == 0 && !HasLeases(job.info().name) &&
        !checks_.HasVotes(job.info().name)) {
        job.SetNumericClass("");
    }
}

bool JobQueue::HasLeases(const std::string& job) const {
    return std::any_of(leases_.begin(), leases_.end(),
                       [&](const auto& entry) { return entry.second.job == job; });
}

void JobQueue::Revoke(const std::set<LeaseId>& leases) {
    for (const LeaseId id : leases) {
        const auto it = leases_.find(id);
        workers_.at(it->second.worker).revoked.push_back(id);
        Forget(it);
        news_ = true;
    }
}

void JobQueue::RevokeJob(const std::string& job) {
    losses_.Forget(job);
    checks_.Forget(job);
    std::set<LeaseId> leases;
    for (const auto& [id, lease] : leases_) {
        if (lease.job == job) {
            leases.insert(id);
        }
    }
    Revoke(leases);
}

std::vector<LeaseId> JobQueue::TakeRevoked(WorkerId id) {
    return std::exchange(workers_.at(id).revoked, {});
}

void JobQueue::Tick(TimePoint now) {
    ExcuseAbsence(now);
    for (auto& [id, worker] : workers_) {
        if (!worker.silent && ToSeconds(now - worker.last_heard) > silent_seconds_) {
            const LogScope scope({.worker = worker.info.name});
            spdlog::warn("worker {}: silent for {} s, its {} leases go to others", worker.info.name,
                         silent_seconds_, worker.leases.size());
            worker.silent = true;
            while (!worker.leases.empty()) {
                const LeaseId lease_id = *worker.leases.begin();
                Lease& lease = leases_.at(lease_id);
                Abandon(lease_id, &lease);
                RequeueIfLate(&Find(lease.job), lease.unit);
            }
        }
    }
    for (auto& [id, lease] : leases_) {
        if (!lease.late && now >= lease.deadline) {
            const LogScope scope(
                {.job = lease.job, .worker = workers_.at(lease.worker).info.name, .lease = id});
            spdlog::debug("{}: lease {} is late", lease.job, id);
            lease.late = true;
            RequeueIfLate(&Find(lease.job), lease.unit);
        }
        if (!lease.abandoned && now >= lease.deadline + (lease.deadline - lease.issued)) {
            Abandon(id, &lease);
        }
    }
    ConcludeChecks(now);
}

// A server that was stopped or busy for long has heard nobody meanwhile: nobody is late for that.
void JobQueue::ExcuseAbsence(TimePoint now) {
    const Duration gap = now - std::exchange(last_tick_, now).value_or(now);
    if (ToSeconds(gap) <= kMaxTickGap) {
        return;
    }
    for (auto& [id, worker] : workers_) {
        worker.last_heard = std::min(now, worker.last_heard + gap);
    }
    for (auto& [id, lease] : leases_) {
        lease.issued += gap;
        lease.expected += gap;
        lease.deadline += gap;
    }
}

}  // namespace relume::jobs
