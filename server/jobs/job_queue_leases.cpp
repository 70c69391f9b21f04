#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/base/log.h"
#include "server/jobs/check_result.h"
#include "server/jobs/job_queue.h"

// Leases of JobQueue: lending, answers, losses. Invariant: each lease in the table is on a unit of
// its job's open passes that is not done.
namespace relume::jobs {
namespace {

constexpr double kSpeedWeight = 0.2;  // of the newest lease in the running mean of a worker's speed
constexpr double kMaxSpeed = 1e9;     // samples/s a thread that are believed
constexpr double kMaxTickGap = 5;     // seconds; a longer one is the server's own absence

}  // namespace

bool JobQueue::MayWorkOn(const Worker& worker, Job* job, TimePoint now) {
    if (!job->info().held.empty()) {
        return false;
    }
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
    if (worker.silent || worker.leases.size() >= worker.credits ||
        worker.reported_held >= 2 * std::uint64_t{worker.credits}) {
        return std::nullopt;
    }
    for (auto it = active_.begin(); it != active_.end();) {
        Job* job = it->second;
        if (!job->active()) {
            it = active_.erase(it);
            continue;
        }
        if (auto grant = Lend(id, job, now)) {
            return grant;
        }
        ++it;
    }
    if (worker.leases.size() >= static_cast<std::size_t>(worker.info.threads)) {
        return std::nullopt;
    }
    // A thread is idle and nothing waits: take over from those who are slow.
    for (const auto& [number, job] : active_) {
        if (job->info().state == JobState::kRendering && MayWorkOn(worker, job, now)) {
            if (const auto unit = FindRace(id, worker, *job, now)) {
                return Issue(id, job, *unit, now);
            }
        }
    }
    return std::nullopt;
}

std::optional<LeaseGrant> JobQueue::Lend(WorkerId id, Job* job, TimePoint now) {
    if (!MayWorkOn(workers_.at(id), job, now)) {
        return std::nullopt;
    }
    if (job->info().state == JobState::kQueued) {
        job->Start(now);
        NoteStateOf(job);
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
        return !Holds(id, job, u) && !(job.Refused(u, id) && HasOther(id, job));
    };
    const auto first = job.FindPending(0, wanted);
    if (!first || *first >= job.FirstSpareUnit() || !WouldDelay(worker, job, job.Samples(*first))) {
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
    for (const auto& [id, other] : workers_) {
        if (!other.silent && other.credits > 0 && other.info.samples_per_second > 0 &&
            other.info.numeric_class == worker.info.numeric_class) {
            speed += other.info.samples_per_second;
            threads += other.info.threads;
        }
    }
    const double own = PredictSeconds(PaceOf(worker, job, worker.samples_out), samples);
    return WouldBeLast(own, samples, job.SamplesAwaited(), speed, threads);
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
            Holds(id, job, lease.unit)) {
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
    SetDeadline(worker, worker.jobs[name].scene_ready, worker.samples_out, &lease, now);

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

const TileTask* JobQueue::TaskOf(LeaseId lease) const {
    const auto it = leases_.find(lease);
    return it == leases_.end() ? nullptr : &it->second.task;
}

bool JobQueue::IsLent(LeaseId lease, WorkerId worker) const {
    const auto it = leases_.find(lease);
    return it != leases_.end() && it->second.worker == worker;
}

std::pair<std::string, std::uint64_t> JobQueue::UnitOf(LeaseId lease) const {
    const Lease& lent = leases_.at(lease);
    return {lent.job, lent.unit};
}

ResultVerdict JobQueue::AddResult(WorkerId id, LeaseId lease_id, const std::string& name,
                                  TileResult result, TimePoint now) {
    const auto it = leases_.find(lease_id);
    if (it == leases_.end() || it->second.worker != id || it->second.job != name) {
        if (const auto job = jobs_.find(name); job != jobs_.end()) {
            job->second->CountDuplicate();
        }
        return ResultVerdict::kDuplicate;
    }
    try {
        CheckResult(it->second.task, result);
    } catch (const Error& error) {
        return Wrong(it, error.what(), now);
    }
    const std::size_t unit = it->second.unit;
    Forget(it);
    TakeResult(id, &Find(name), unit, lease_id, std::move(result), now);
    return ResultVerdict::kMerged;
}

std::optional<TileTask> JobQueue::TaskOfUnit(const std::string& name, std::uint64_t unit) const {
    const auto it = jobs_.find(name);
    if (it == jobs_.end() || !it->second->active() || !it->second->Awaits(unit)) {
        return std::nullopt;
    }
    return it->second->Task(unit);
}

ResultVerdict JobQueue::AddLateResult(WorkerId id, const std::string& name, std::uint64_t unit,
                                      TileResult result, TimePoint now) {
    const auto task = TaskOfUnit(name, unit);
    if (!task) {
        return ResultVerdict::kDuplicate;
    }
    Job& job = Find(name);
    Worker& worker = workers_.at(id);
    const std::string& needed = job.info().numeric_class;
    if (!needed.empty() && needed != worker.info.numeric_class) {
        return ResultVerdict::kDuplicate;
    }
    try {
        CheckResult(*task, result);
    } catch (const Error& error) {
        RejectLateResult(id, name, error.what(), now);
        return ResultVerdict::kWrong;
    }
    if (needed.empty()) {
        job.SetNumericClass(worker.info.numeric_class);
    }
    TakeResult(id, &job, unit, 0, std::move(result), now);
    return ResultVerdict::kMerged;
}

// A checked answer to a unit of the job that has none. `own`: the lease that it answers, which is
// out of the table; 0: none.
void JobQueue::TakeResult(WorkerId id, Job* job, std::size_t unit, LeaseId own, TileResult result,
                          TimePoint now) {
    Worker& worker = workers_.at(id);
    const std::string& name = job->info().name;
    const std::uint64_t samples = job->Samples(unit);
    if (result.seconds > 0) {
        const double speed = std::min(kMaxSpeed, static_cast<double>(samples) / result.seconds) *
                             worker.info.threads;
        double& mean = worker.info.samples_per_second;
        mean = mean > 0 ? mean + kSpeedWeight * (speed - mean) : speed;
    }
    worker.info.samples_done += samples;
    Involvement& involvement = worker.jobs[name];
    involvement.scene_ready = involvement.scene_ready || own != 0;
    involvement.problems = 0;

    std::set<LeaseId> others = job->Leases(unit);
    others.erase(own);
    Revoke(others);
    job->Accept(unit, worker.info.name, std::move(result), now);
    NoteStateOf(job);
}

void JobQueue::CountMergeSeconds(const std::string& name, double seconds) {
    if (const auto it = jobs_.find(name); it != jobs_.end()) {
        it->second->CountMergeSeconds(seconds);
    }
}

ResultVerdict JobQueue::RejectResult(WorkerId id, LeaseId lease_id, const std::string& reason,
                                     TimePoint now) {
    const auto it = leases_.find(lease_id);
    if (it == leases_.end() || it->second.worker != id) {
        return ResultVerdict::kDuplicate;
    }
    return Wrong(it, reason, now);
}

void JobQueue::RejectLateResult(WorkerId id, const std::string& name, const std::string& reason,
                                TimePoint now) {
    ++results_wrong_;
    const std::string said =
        fmt::format("worker {}: wrong result: {}", workers_.at(id).info.name, reason);
    const LogScope scope({.job = name, .worker = workers_.at(id).info.name});
    spdlog::error("{}: {}", name, said);
    Find(name).AddNote(said, now);
}

ResultVerdict JobQueue::Wrong(Leases::iterator it, const std::string& reason, TimePoint now) {
    const std::string name = it->second.job;
    const WorkerId id = it->second.worker;
    const TileRect r = it->second.task.rect;
    const std::string said = fmt::format("worker {}: wrong result for pixels {},{},{},{}: {}",
                                         workers_.at(id).info.name, r.x0, r.y0, r.x1, r.y1, reason);
    const LogScope scope({.job = name, .worker = workers_.at(id).info.name, .lease = it->first});
    spdlog::error("{}: {}", name, said);
    ++results_wrong_;
    Job& job = Find(name);
    if (job.Refuse(it->second.unit, id) >= kMaxBadResults) {
        Fail(name, said, now);
    } else {
        GiveBack(it);
        job.AddNote(said, now);
    }
    return ResultVerdict::kWrong;
}

void JobQueue::ReturnLeases(WorkerId id, const std::vector<LeaseId>& leases) {
    for (const LeaseId lease : leases) {
        if (const auto it = leases_.find(lease); it != leases_.end() && it->second.worker == id) {
            GiveBack(it);
        }
    }
}

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
    if (job.info().samples_done == 0 && !HasLeases(job.info().name)) {
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
        if (!worker.silent && ToSeconds(now - worker.last_heard) > kSilentSeconds) {
            const LogScope scope({.worker = worker.info.name});
            spdlog::warn("worker {}: silent for {} s, its {} leases go to others", worker.info.name,
                         kSilentSeconds, worker.leases.size());
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
