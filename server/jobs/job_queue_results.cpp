#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/base/log.h"
#include "server/jobs/check_result.h"
#include "server/jobs/job_queue.h"

// Answers to leases of JobQueue: checked, counted, merged, refused.
namespace relume::jobs {
namespace {

constexpr double kSpeedWeight = 0.2;  // of the newest lease in the running mean of a worker's speed
constexpr double kMaxSpeed = 1e9;     // samples/s a thread that are believed

}  // namespace

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
    if ((!needed.empty() && needed != worker.info.numeric_class) ||
        !worker.info.quarantined.empty()) {
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
    share_.Use(job->info().number, KeyOf(*job), std::min(result.seconds, kMaxPredictedSeconds),
               now);
    Involvement& involvement = worker.jobs[name];
    involvement.scene_ready = involvement.scene_ready || own != 0;
    involvement.problems = 0;
    job->DropLease(unit, own);
    if (auto answer = CrossCheck(id, job, unit, std::move(result), now)) {
        Accept(job, unit, std::move(*answer), now);
    }
}

void JobQueue::Accept(Job* job, std::size_t unit, CrossChecks::Vote answer, TimePoint now) {
    const std::string& name = job->info().name;
    if (const auto it = workers_.find(answer.id); it != workers_.end()) {
        it->second.info.samples_done += job->Samples(unit);
    }
    Revoke(std::set<LeaseId>(job->Leases(unit)));
    losses_.Done(name, unit);
    job->Accept(unit, answer.worker, std::move(answer.result), now);
    NoteStateOf(job);
    if (!job->active()) {
        losses_.Forget(name);
    }
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

}  // namespace relume::jobs
