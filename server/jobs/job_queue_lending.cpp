#include <fmt/format.h>

#include <algorithm>

#include "server/jobs/job_queue.h"

// Lending of JobQueue: which unit goes to which worker, first come or as a race.
namespace relume::jobs {

bool JobQueue::MayWorkOn(const Worker& worker, Job* job, TimePoint now) {
    const std::string& needed = job->info().numeric_class;
    if (!needed.empty() && needed != worker.info.numeric_class) {
        job->AddNote(fmt::format("worker {} ({}) gets no leases: the job runs on {}",
                                 worker.info.name, worker.info.numeric_class, needed),
                     now);
        return false;
    }
    const auto it = worker.jobs.find(job->info().name);
    return it == worker.jobs.end() || it->second.paused_until <= now;
}

bool JobQueue::HasOther(WorkerId id, const Job& job) const {
    return std::any_of(workers_.begin(), workers_.end(), [&](const auto& entry) {
        const Worker& other = entry.second;
        return entry.first != id && !other.silent && other.credits > 0 &&
               other.info.numeric_class == job.info().numeric_class;
    });
}

std::optional<LeaseGrant> JobQueue::NextLease(WorkerId id, TimePoint now) {
    const Worker& worker = workers_.at(id);
    // What it says that it holds is up to a report old; only far beyond the credits it tells that
    // leases which were given up here still wait there.
    if (worker.silent || !worker.info.quarantined.empty() ||
        worker.leases.size() >= worker.credits ||
        worker.reported_held >= 2 * std::uint64_t{worker.credits}) {
        return std::nullopt;
    }
    if (std::optional<LeaseGrant> grant; LendAlone(id, now, &grant)) {
        return grant;
    }
    if (auto grant = LendFirst(id, now)) {
        return grant;
    }
    if (worker.leases.size() >= static_cast<std::size_t>(worker.info.threads)) {
        return std::nullopt;
    }
    // A thread is idle and nothing waits: take over from those who are slow.
    return RaceFirst(id, now);
}

std::optional<LeaseGrant> JobQueue::Lend(WorkerId id, Job* job, TimePoint now) {
    if (!MayWorkOn(workers_.at(id), job, now)) {
        return std::nullopt;
    }
    if (job->info().state == JobState::kQueued) {
        job->Start(now);
        NoteStateOf(job);
    }
    if (!losses_.empty() && !SceneReadyAt(workers_.at(id), job->info().name) &&
        (losses_.LoadAlone(job->info().name) || Shuns(id, *job, std::nullopt))) {
        return std::nullopt;
    }
    const auto unit = FindUnit(id, *job);
    if (!unit) {
        return std::nullopt;
    }
    job->Take(*unit);
    return Issue(id, job, *unit, now);
}

// The first that waits; to a worker that is too slow for it, one that nobody will wait for.
std::optional<std::size_t> JobQueue::FindUnit(WorkerId id, const Job& job) const {
    const Worker& worker = workers_.at(id);
    const auto wanted = [&](std::size_t u) {
        return !Holds(id, job, u) && !(job.Refused(u, id) && HasOther(id, job)) &&
               MayVote(id, job, u) &&
               (losses_.empty() || (!losses_.UnitAlone(job.info().name, u) && !Shuns(id, job, u)));
    };
    const auto first = job.FindPending(0, wanted);
    // Beside other jobs it would be busy with these for ever, and the unit left to nobody.
    if (!first || active_.size() > 1 || *first >= job.FirstSpareUnit() ||
        !WouldDelay(worker, job, job.Samples(*first))) {
        return first;
    }
    const auto spare = job.FindPending(job.FirstSpareUnit(), wanted);
    if (spare || worker.leases.size() >= static_cast<std::size_t>(worker.info.threads)) {
        return spare;
    }
    return first;
}

// True if this worker would be the last of all with a unit that is awaited.
bool JobQueue::WouldDelay(const Worker& worker, const Job& job, std::uint64_t samples) const {
    double speed = 0;
    int threads = 0;
    std::uint64_t out = 0;
    for (const auto& [id, other] : workers_) {
        out += other.samples_out;
        if (!other.silent && other.credits > 0 && other.info.samples_per_second > 0 &&
            other.info.numeric_class == worker.info.numeric_class) {
            speed += other.info.samples_per_second;
            threads += other.info.threads;
        }
    }
    const double own = PredictSeconds(PaceOf(worker, job, worker.samples_out), samples);
    // What all have in hand comes before they could take this unit, awaited or not.
    return WouldBeLast(own, samples, std::max(job.SamplesAwaited(), out), speed, threads);
}

WorkerPace JobQueue::PaceOf(const Worker& worker, const Job& job, std::uint64_t samples_before) {
    const auto it = worker.jobs.find(job.info().name);
    return {worker.info.samples_per_second, worker.info.threads, samples_before,
            it != worker.jobs.end() && it->second.scene_ready};
}

// What holds up a plan comes first.
std::optional<std::size_t> JobQueue::FindRace(WorkerId id, const Worker& worker, const Job& job,
                                              TimePoint now) const {
    const auto awaited = FindRace(id, worker, job, true, now);
    return awaited ? awaited : FindRace(id, worker, job, false, now);
}

// The oldest lease that is overdue or of which nothing is known; else the one expected back last,
// if the idle thread would be sooner: that one its holder has probably not begun. Among those that
// are `awaited` for a plan or the job's end, or the others.
std::optional<std::size_t> JobQueue::FindRace(WorkerId id, const Worker& worker, const Job& job,
                                              bool awaited, TimePoint now) const {
    const Lease* best = nullptr;
    double longest = 0;
    for (const auto& [lease_id, lease] : leases_) {
        if (lease.job != job.info().name || lease.abandoned ||
            awaited != (lease.unit < job.FirstSpareUnit()) || job.Refused(lease.unit, id) ||
            Holds(id, job, lease.unit) || lease.alone || !MayVote(id, job, lease.unit) ||
            losses_.UnitAlone(lease.job, lease.unit)) {
            continue;
        }
        const auto& holders = job.Leases(lease.unit);
        if (static_cast<std::size_t>(std::count_if(
                holders.begin(), holders.end(),
                [&](LeaseId holder) { return !leases_.at(holder).abandoned; })) >= kMaxHolders) {
            continue;
        }
        const double remaining = ToSeconds(lease.expected - now);
        if (ShouldRace(0, remaining)) {
            return lease.unit;
        }
        if (remaining > longest) {
            longest = remaining;
            best = &lease;
        }
    }
    if (best == nullptr) {
        return std::nullopt;
    }
    const double own = PredictSeconds(PaceOf(worker, job, 0), best->samples);
    return ShouldRace(own, longest) ? std::optional(best->unit) : std::nullopt;
}

LeaseGrant JobQueue::Issue(WorkerId id, Job* job, std::size_t unit, TimePoint now) {
    Worker& worker = workers_.at(id);
    const std::string& name = job->info().name;
    const LeaseId lease_id = ++last_lease_;
    Lease lease;
    lease.job = name;
    lease.worker = id;
    lease.unit = unit;
    lease.task = job->Task(unit);
    lease.samples = job->Samples(unit);
    lease.issued = now;
    Involvement& involvement = worker.jobs[name];
    if (involvement.since == TimePoint{}) {
        involvement.since = now;
    }
    SetDeadline(worker, involvement.scene_ready, worker.samples_out, &lease, now);
    lease.charge = ChargeFor(*job, lease.samples);
    share_.Lend(lease.charge);
    worker.last = lease.charge.key;

    if (job->info().numeric_class.empty()) {
        job->SetNumericClass(worker.info.numeric_class);
    }
    job->AddLease(unit, lease_id, now);
    worker.leases.insert(lease_id);
    worker.samples_out += lease.samples;
    LeaseGrant grant{lease_id, name, lease.task, ToSeconds(lease.deadline - now), unit};
    leases_.emplace(lease_id, std::move(lease));
    return grant;
}

void JobQueue::SetDeadline(const Worker& worker, bool scene_ready, std::uint64_t samples_before,
                           Lease* lease, TimePoint now) {
    const WorkerPace pace{worker.info.samples_per_second, worker.info.threads, samples_before,
                          scene_ready};
    lease->expected = now + FromSeconds(PredictSeconds(pace, lease->samples));
    lease->deadline = now + FromSeconds(DeadlineSeconds(pace, lease->samples));
}

}  // namespace relume::jobs
