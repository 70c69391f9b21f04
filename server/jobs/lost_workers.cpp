#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "core/base/log.h"
#include "server/jobs/job_queue.h"

// Workers of JobQueue that were lost, and what becomes of the work that costs workers.
namespace relume::jobs {
namespace {

std::string SignalText(int signal) {
    const char* name = sigabbrev_np(signal);
    return name != nullptr ? fmt::format("died of signal {} (SIG{})", signal, name)
                           : fmt::format("died of signal {}", signal);
}

}  // namespace

void JobQueue::SetMachine(WorkerId id, const std::string& machine) {
    Worker& worker = workers_.at(id);
    worker.machine = machine;
    const auto it = quarantined_.find({machine, worker.asked});
    const bool odd = it != quarantined_.end();
    worker.info.quarantined = odd ? it->second.why : "";
    worker.info.quarantined_since = odd ? it->second.since : TimePoint{};
}

void JobQueue::Crashed(WorkerId id, const std::string& job, LeaseId lease, int signal) {
    Worker& worker = workers_.at(id);
    worker.last_words = LastWords{job, SignalText(signal), 0};
    const auto it = leases_.find(lease);
    if (it != leases_.end() && it->second.worker == id && it->second.job == job) {
        worker.last_words->lease = lease;
    } else if (lease != 0) {
        worker.last_words->job.clear();  // of a lease that is no more: nothing to try again
    }
}

void JobQueue::LoseWorker(WorkerId id, const std::string& how, TimePoint now) {
    const Worker& worker = workers_.at(id);
    const auto loss_of = [&](const Lease& lease, bool loading) {
        const TileRect& r = lease.task.rect;
        LossBook::Loss loss;
        loss.worker = worker.info.name;
        loss.machine = worker.machine;
        loss.how = worker.last_words ? worker.last_words->how : how;
        if (loading) {
            loss.at = "it loaded the scene";
            loss.since = worker.jobs.at(lease.job).since;
        } else {
            loss.at = fmt::format("it had pixels {},{},{},{} to render", r.x0, r.y0, r.x1, r.y1);
            loss.unit = lease.unit;
            loss.since = lease.issued;
        }
        return loss;
    };
    std::vector<std::pair<std::string, LossBook::Loss>> losses;
    if (worker.last_words && jobs_.count(worker.last_words->job) != 0) {
        const LastWords& words = *worker.last_words;
        Lease lease;
        lease.job = words.job;
        if (words.lease != 0) {
            lease = leases_.at(words.lease);
        }
        if (worker.jobs.count(lease.job) != 0) {
            losses.emplace_back(lease.job, loss_of(lease, words.lease == 0));
            losses.back().second.crashed = true;
        }
    } else {
        for (const LeaseId lease_id : worker.leases) {
            const Lease& lease = leases_.at(lease_id);
            const bool loading = !SceneReadyAt(worker, lease.job);
            const bool told =
                loading && std::any_of(losses.begin(), losses.end(), [&](const auto& l) {
                    return l.first == lease.job && !l.second.unit;
                });
            if (!told) {
                losses.emplace_back(lease.job, loss_of(lease, loading));
            }
        }
    }
    RemoveWorker(id);
    for (const auto& [job, loss] : losses) {
        NoteLoss(job, loss, now);
    }
}

void JobQueue::NoteLoss(const std::string& name, const LossBook::Loss& loss, TimePoint now) {
    Job& job = Find(name);
    if (!job.active()) {
        return;
    }
    const LogScope scope({.job = name, .worker = loss.worker});
    const std::string why = losses_.Note(name, loss, job.info().samples_done, now);
    if (!why.empty()) {
        spdlog::error("{}: {}", name, why);
        Fail(name, why, now);
    } else if (loss.crashed) {
        const std::string said =
            fmt::format("worker {} {} while {}; tried again", loss.worker, loss.how, loss.at);
        spdlog::error("{}: {}", name, said);
        job.AddNote(said, now);
    }
}

bool JobQueue::Shuns(WorkerId id, const Job& job, std::optional<std::size_t> unit) const {
    const std::set<std::string>* machines = losses_.Machines(job.info().name, unit);
    if (machines == nullptr || machines->count(workers_.at(id).machine) == 0) {
        return false;
    }
    const std::string& needed = job.info().numeric_class;
    return std::any_of(workers_.begin(), workers_.end(), [&](const auto& entry) {
        const Worker& other = entry.second;
        return !other.silent && other.credits > 0 && machines->count(other.machine) == 0 &&
               (needed.empty() || other.info.numeric_class == needed);
    });
}

std::optional<std::size_t> JobQueue::FindAlone(WorkerId id, const Job& job) const {
    const std::string& name = job.info().name;
    if (!SceneReadyAt(workers_.at(id), name)) {
        if (Shuns(id, job, std::nullopt)) {
            return std::nullopt;
        }
        if (losses_.LoadAlone(name)) {
            return job.FindPending(0, [&](std::size_t u) { return !Shuns(id, job, u); });
        }
    }
    return job.FindPending(0, [&](std::size_t u) {
        return losses_.UnitAlone(name, u) && !Holds(id, job, u) && !Shuns(id, job, u) &&
               MayVote(id, job, u);
    });
}

bool JobQueue::LendAlone(WorkerId id, TimePoint now, std::optional<LeaseGrant>* grant) {
    if (losses_.empty()) {
        return false;
    }
    const Worker& worker = workers_.at(id);
    if (std::any_of(worker.leases.begin(), worker.leases.end(),
                    [&](LeaseId lease) { return leases_.at(lease).alone; })) {
        return true;
    }
    for (const auto& [number, job] : active_) {
        const std::string& name = job->info().name;
        if (job->info().state != JobState::kRendering || !MayWorkOn(worker, job, now)) {
            continue;
        }
        const bool loads = losses_.LoadAlone(name);
        if (loads && std::any_of(leases_.begin(), leases_.end(), [&](const auto& entry) {
                return entry.second.job == name && entry.second.alone && !entry.second.abandoned;
            })) {
            continue;  // another worker tries
        }
        const auto unit = FindAlone(id, *job);
        if (!unit) {
            continue;
        }
        // One worker at a time lets its hands get empty for it.
        WorkerId& next = next_alone_[name];
        const auto waiting = workers_.find(next);
        if (next != id && waiting != workers_.end() && !waiting->second.silent &&
            waiting->second.credits > 0 && FindAlone(next, *job) &&
            MayWorkOn(waiting->second, job, now)) {
            continue;
        }
        next = id;
        if (worker.leases.empty()) {
            next_alone_.erase(name);
            job->Take(*unit);
            *grant = Issue(id, job, *unit, now);
            leases_.at((*grant)->id).alone = true;
        }
        return true;
    }
    return false;
}

}  // namespace relume::jobs
