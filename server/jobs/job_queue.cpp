#include "server/jobs/job_queue.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/base/log.h"
#include "server/jobs/error_curve.h"

// Jobs and workers. Their order: job_queue_order.cpp; leases: job_queue_leases.cpp,
// job_queue_lending.cpp, job_queue_results.cpp; what is seen from outside: queue_status.cpp.
namespace relume::jobs {
namespace {

double NoiseFalls(const std::vector<PassSummary>& passes) {
    if (passes.empty()) {
        return 0;
    }
    return FallsBetween({passes.front().samples, passes.front().relmse},
                        {TotalSamples(passes), passes.back().relmse});
}

constexpr std::uint32_t kMaxCredits = 4096;
constexpr std::size_t kMaxWorkerName = 128;

// What may be shown in a terminal.
std::string CleanName(const std::string& name) {
    std::string clean;
    for (const char c : name.substr(0, kMaxWorkerName)) {
        clean += c > ' ' && c < 127 ? c : '_';
    }
    return clean.empty() ? "worker" : clean;
}

}  // namespace

const Job& JobQueue::Find(const std::string& name) const {
    const auto it = jobs_.find(name);
    if (it == jobs_.end()) {
        ThrowNotFound(fmt::format("no job '{}'; relume jobs lists those that are there", name));
    }
    return *it->second;
}

Job& JobQueue::Find(const std::string& name) {
    return const_cast<Job&>(std::as_const(*this).Find(name));
}

void JobQueue::AddJob(const std::string& name, JobSetup setup, TimePoint now) {
    const std::uint64_t number = ++last_number_;
    auto job = std::make_unique<Job>(name, number, std::move(setup), now);
    by_number_[number] = job.get();
    active_[number] = not_over_[number] = job.get();
    if (!jobs_.emplace(name, std::move(job)).second) {
        by_number_.erase(number);
        active_.erase(number);
        not_over_.erase(number);
        throw Error(ErrorCode::kAlreadyExists, fmt::format("job '{}' is there already", name));
    }
    Place(&Find(name));
    news_ = true;
}

void JobQueue::RestoreJob(SavedJob saved, JobSetup setup, TimePoint now) {
    const std::string name = saved.info.name;
    const std::uint64_t number = saved.info.number;
    const bool over = IsOver(saved.info.state);
    auto job = std::make_unique<Job>(std::move(saved), std::move(setup), now);
    by_number_[number] = job.get();
    if (!over) {
        not_over_[number] = job.get();
    }
    last_number_ = std::max(last_number_, number);
    Job* made = job.get();
    jobs_[name] = std::move(job);
    NoteStateOf(made);
    news_ = true;
}

void JobQueue::Extend(const std::string& name, Checkpoint checkpoint, std::shared_ptr<Film> film,
                      JobSetup setup, TimePoint now) {
    Job& job = Find(name);
    if (!job.info().outcome) {
        throw Error(ErrorCode::kFailedPrecondition,
                    fmt::format("{} has no image; only a job that has can be extended", name));
    }
    job.Extend(std::move(checkpoint), std::move(film), std::move(setup), now);
    not_over_[job.info().number] = &job;
    NoteStateOf(&job);
    news_ = true;
}

void JobQueue::Hold(const std::string& name, const std::string& why, TimePoint now) {
    Job& job = Find(name);
    job.Hold(why, now);
    NoteStateOf(&job);
}

std::vector<std::string> JobQueue::TakeOver() {
    std::vector<std::string> over;
    std::erase_if(not_over_, [&](const auto& entry) {
        if (!IsOver(entry.second->info().state)) {
            return false;
        }
        over.push_back(entry.second->info().name);
        return true;
    });
    return over;
}

std::vector<std::string> JobQueue::Rendering() const {
    std::vector<std::string> names;
    for (const auto& [number, job] : active_) {
        if (job->info().state == JobState::kRendering) {
            names.push_back(job->info().name);
        }
    }
    return names;
}

std::vector<const JobInfo*> JobQueue::List(
    std::uint64_t before, std::size_t limit,
    const std::function<bool(const std::string& name)>& wanted) const {
    std::vector<const JobInfo*> list;
    auto it = before == 0 ? by_number_.end() : by_number_.lower_bound(before);
    while (it != by_number_.begin() && list.size() < limit) {
        const JobInfo& info = (--it)->second->info();
        if (!wanted || wanted(info.name)) {
            list.push_back(&info);
        }
    }
    return list;
}

void JobQueue::Cancel(const std::string& name, TimePoint now) {
    Job& job = Find(name);
    job.Cancel(now);
    Place(&job);
    RevokeJob(name);
}

void JobQueue::CancelKeepingImage(const std::string& name, TimePoint now) {
    Job& job = Find(name);
    job.CancelKeepingImage(now);
    NoteStateOf(&job);
    if (!job.active()) {
        RevokeJob(name);
    }
}

void JobQueue::Fail(const std::string& name, const std::string& message, TimePoint now) {
    Job& job = Find(name);
    job.Fail(message, now);
    Place(&job);
    RevokeJob(name);
}

std::vector<std::string> JobQueue::ForgetOverJobs(std::size_t keep) {
    std::size_t over = 0;
    for (const auto& [number, job] : by_number_) {
        over += IsOver(job->info().state) ? 1 : 0;
    }
    std::vector<std::string> forgotten;
    for (auto it = by_number_.begin(); it != by_number_.end() && over > keep;) {
        if (!IsOver(it->second->info().state)) {
            ++it;
            continue;
        }
        const std::string name = it->second->info().name;
        forgotten_.Add(it->second->info());
        not_over_.erase(it->first);
        it = by_number_.erase(it);
        for (auto& [id, worker] : workers_) {
            worker.jobs.erase(name);
        }
        losses_.Forget(name);
        checks_.Forget(name);
        jobs_.erase(name);
        forgotten.push_back(name);
        --over;
    }
    return forgotten;
}

void JobQueue::NoteStateOf(Job* job) {
    Place(job);
    news_ = job->TakeNewWork() || news_;
    if (job->TakeWantsPlan()) {
        to_plan_.push_back(job->info().name);
    }
    if (job->info().state == JobState::kFiltering) {
        to_filter_.push_back(job->info().name);
    }
}

std::optional<PlanWork> JobQueue::TakePlanWork(TimePoint now) {
    while (!to_plan_.empty()) {
        const auto first = std::ranges::max_element(to_plan_, {}, [&](const std::string& job) {
            const auto it = jobs_.find(job);
            return it == jobs_.end() ? kMaxPriority : it->second->info().priority;
        });
        const std::string name = std::move(*first);
        to_plan_.erase(first);
        const auto it = jobs_.find(name);
        if (it == jobs_.end()) {
            continue;
        }
        if (auto work = it->second->TakePlanWork(now)) {
            return work;
        }
    }
    return std::nullopt;
}

void JobQueue::Planned(const std::string& name, PlanResult result, TimePoint now) {
    const auto it = jobs_.find(name);
    if (it == jobs_.end()) {
        return;
    }
    Job* job = it->second.get();
    job->Planned(std::move(result), now);
    NoteStateOf(job);
    if (job->info().state == JobState::kFailed) {
        RevokeJob(name);
    }
}

std::optional<JobQueue::FilterWork> JobQueue::TakeFilterWork() {
    while (!to_filter_.empty()) {
        const std::string name = std::move(to_filter_.front());
        to_filter_.pop_front();
        const auto it = jobs_.find(name);
        if (it == jobs_.end()) {
            continue;
        }
        if (auto sampled = it->second->TakeSampled()) {
            const Checkpoint& checkpoint = *sampled->checkpoint;
            const JobInfo& info = it->second->info();
            return FilterWork{name,
                              std::move(sampled->film),
                              *checkpoint.selector,
                              *checkpoint.decisions,
                              std::move(sampled->checkpoint),
                              info.stop == StopReason::kCancelled,
                              info.samples_done > 0 ? static_cast<double>(info.rays) /
                                                          static_cast<double>(info.samples_done)
                                                    : 0,
                              NoiseFalls(info.passes)};
        }
    }
    return std::nullopt;
}

void JobQueue::Succeed(const std::string& name, Outcome outcome, TimePoint now) {
    Job& job = Find(name);
    job.Succeed(std::move(outcome), now);
    Place(&job);
}

WorkerId JobQueue::AddWorker(const std::string& name, const std::string& numeric_class, int threads,
                             TimePoint now) {
    const std::string clean = CleanName(name);
    std::string unique = clean;
    const auto taken = [&] {
        return std::any_of(workers_.begin(), workers_.end(),
                           [&](const auto& entry) { return entry.second.info.name == unique; });
    };
    for (int n = 2; taken(); ++n) {
        unique = fmt::format("{}#{}", clean, n);
    }
    Worker worker;
    worker.info.name = unique;
    worker.info.numeric_class = numeric_class;
    worker.info.threads = std::clamp(threads, 1, 4096);
    worker.last_heard = now;
    worker.asked = clean;
    workers_.emplace(++last_worker_, std::move(worker));
    SetMachine(last_worker_, clean);
    SetSlack();
    return last_worker_;
}

void JobQueue::RemoveWorker(WorkerId id) {
    for (auto it = leases_.begin(); it != leases_.end();) {
        const auto lease = it++;
        if (lease->second.worker == id) {
            GiveBack(lease);
        }
    }
    workers_.erase(id);
    SetSlack();
}

void JobQueue::Heard(WorkerId id, TimePoint now) {
    Worker& worker = workers_.at(id);
    worker.last_heard = now;
    worker.silent = false;
}

void JobQueue::SetCredits(WorkerId id, std::uint32_t credits, std::uint32_t held) {
    Worker& worker = workers_.at(id);
    worker.credits = std::min(credits, kMaxCredits);
    worker.reported_held = held;
}

void JobQueue::SceneReady(WorkerId id, const std::string& name,
                          const std::vector<std::string>& notes, TimePoint now) {
    const auto it = jobs_.find(name);
    if (it == jobs_.end()) {
        return;
    }
    for (const auto& note : notes) {
        it->second->AddNote(note, now);
    }
    Worker& worker = workers_.at(id);
    if (std::exchange(worker.jobs[name].scene_ready, true)) {
        return;
    }
    losses_.Loaded(name);
    // Only now do its leases begin to take time.
    std::uint64_t before = 0;
    for (const LeaseId lease_id : worker.leases) {
        Lease& lease = leases_.at(lease_id);
        lease.alone = lease.alone && losses_.UnitAlone(lease.job, lease.unit);
        if (lease.job == name && !lease.late) {
            lease.issued = now;
            SetDeadline(worker, true, before, &lease, now);
        }
        before += lease.samples;
    }
}

void JobQueue::Problem(WorkerId id, const std::string& name, const std::string& message,
                       bool transient, TimePoint now) {
    const auto it = jobs_.find(name);
    if (it == jobs_.end() || IsOver(it->second->info().state)) {
        return;
    }
    if (!transient) {
        Fail(name, message, now);
        return;
    }
    Worker& worker = workers_.at(id);
    const std::string said = fmt::format("worker {}: {}", worker.info.name, message);
    const LogScope scope({.job = name, .worker = worker.info.name});
    spdlog::warn("{}: {}", name, said);
    Involvement& involvement = worker.jobs[name];
    const std::uint64_t done = it->second->info().samples_done;
    if (involvement.problems == 0) {
        involvement.samples_at_problem = done;
    }
    ++involvement.problems;
    if (involvement.problems >= kMaxProblems && involvement.samples_at_problem == done) {
        Fail(name, said, now);
        return;
    }
    involvement.paused_until = now + FromSeconds(ProblemPauseSeconds(involvement.problems));
    it->second->AddNote(said, now);
}

std::vector<WorkerInfo> JobQueue::Workers(TimePoint now) const {
    std::vector<WorkerInfo> list;
    for (const auto& [id, worker] : workers_) {
        list.push_back(worker.info);
        list.back().leases_held = worker.leases.size();
        list.back().seconds_since_report = ToSeconds(now - worker.last_heard);
    }
    for (const auto& [key, quarantined] : quarantined_) {
        if (std::ranges::none_of(workers_, [&of = key](const auto& entry) {
                return std::pair(entry.second.machine, entry.second.asked) == of;
            })) {
            WorkerInfo& info = list.emplace_back();
            info.name = quarantined.name;
            info.quarantined = quarantined.why;
            info.quarantined_since = quarantined.since;
            info.away = true;
        }
    }
    return list;
}

std::vector<WorkerId> JobQueue::WorkerIds() const {
    std::vector<WorkerId> ids;
    for (const auto& [id, worker] : workers_) {
        ids.push_back(id);
    }
    return ids;
}

}  // namespace relume::jobs
