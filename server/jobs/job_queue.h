#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/film/tile.h"
#include "server/jobs/cross_checks.h"
#include "server/jobs/fair_share.h"
#include "server/jobs/job.h"
#include "server/jobs/lease_policy.h"
#include "server/jobs/loss_book.h"
#include "server/jobs/memory_room.h"
#include "server/jobs/queue_status.h"

namespace relume::jobs {

// A lease as it goes out to a worker.
struct LeaseGrant {
    LeaseId id = 0;
    std::string job;
    TileTask task;
    double deadline_seconds = 0;  // from now
    std::uint64_t unit = 0;       // of the job
};

enum class ResultVerdict {
    kMerged,
    kDuplicate,  // late, or for a job that is over: dropped
    kWrong,      // failed its check; the worker does not get this unit again while there is another
};

// All jobs, workers and leases: who renders what next. Pure state: time comes in as an argument,
// nothing waits and nothing is written. Not thread-safe: the coordinator calls it from its one
// thread.
//
// Jobs get leases in the order of FairShare; a worker that finds nothing there takes from the next.
// A job of higher priority so gets all leases from the next one on, and those that are out are
// finished. Workers of another numeric class than a job's first one get none of its leases. The
// bits of a film do not depend on any of this.
class JobQueue {
  public:
    // --- Jobs. An unknown name throws kNotFound.
    void AddJob(const std::string& name, JobSetup setup, TimePoint now);
    // One of an earlier run of the server; its number is in its info.
    void RestoreJob(SavedJob saved, JobSetup setup, TimePoint now);
    // As Job::Extend. kFailedPrecondition unless the job has succeeded.
    void Extend(const std::string& name, Checkpoint checkpoint, std::shared_ptr<Film> film,
                JobSetup setup, TimePoint now);
    void Hold(const std::string& name, const std::string& why, TimePoint now);
    // As Job::BeginCopy, CopyTiles and TakeCopied.
    const Checkpoint* BeginCopy(const std::string& name, FilmCopy::Sink sink) {
        return Find(name).BeginCopy(std::move(sink));
    }
    bool CopyTiles(const std::string& name, std::size_t count) {
        return Find(name).CopyTiles(count);
    }
    std::optional<Checkpoint> TakeCopied(const std::string& name) {
        return Find(name).TakeCopied();
    }
    void DropCopy(const std::string& name) { Find(name).DropCopy(); }
    bool MergedUnit(const std::string& name, std::size_t unit) const {
        return Find(name).MergedUnit(unit);
    }
    const JobInfo& Get(const std::string& name) const { return Find(name).info(); }
    // False for one that is unknown or has all its samples.
    bool NeedsWorkers(const std::string& name) const {
        const auto it = jobs_.find(name);
        return it != jobs_.end() && it->second->active();
    }
    bool Knows(const std::string& name) const { return jobs_.count(name) != 0; }
    // Names of those that are rendering, oldest first.
    std::vector<std::string> Rendering() const;
    // Those that came to be over since the last call.
    std::vector<std::string> TakeOver();
    // Adds to the job's save_seconds.
    void CountSave(const std::string& name, double seconds) { Find(name).CountSave(seconds); }
    // Newest first: those with a number below `before` (0: all) whose name is `wanted`, at most
    // `limit`.
    std::vector<const JobInfo*> List(
        std::uint64_t before, std::size_t limit,
        const std::function<bool(const std::string& name)>& wanted = {}) const;
    // As Job's: from now on, or for good, no leases are given out.
    void Pause(const std::string& name, TimePoint now);
    void Resume(const std::string& name, TimePoint now);
    void Cancel(const std::string& name, TimePoint now);
    void CancelKeepingImage(const std::string& name, TimePoint now);
    // kInvalidArgument if it is out of range.
    void SetPriority(const std::string& name, int priority, TimePoint now);
    // The job's part of what the farm did in the last minute, 0 to 1; nothing unless it may get
    // leases.
    std::optional<double> ShareOf(const std::string& name, TimePoint now) const;
    void Fail(const std::string& name, const std::string& message, TimePoint now);
    std::optional<JobEvent> FindEvent(const std::string& name, std::uint64_t from) const {
        return Find(name).events().Find(from);
    }
    std::uint64_t LastEvent(const std::string& name) const { return Find(name).events().last(); }
    // Forgets the oldest jobs that are over until at most `keep` such are left; their names.
    std::vector<std::string> ForgetOverJobs(std::size_t keep);

    // A pass that is to be planned: RunPlan's matter, on any thread. Each is handed out once; those
    // of a higher priority first.
    std::optional<PlanWork> TakePlanWork(TimePoint now);
    // What came of it; ignored if the job was cancelled in between.
    void Planned(const std::string& name, PlanResult result, TimePoint now);

    // A job whose samples are all in, for the filter: each is handed out once.
    struct FilterWork {
        std::string name;
        std::shared_ptr<const Film> film;
        std::vector<float> selector;      // of the last plan, as in Plan
        std::vector<Decision> decisions;  // as in Plan
        std::shared_ptr<const Checkpoint> checkpoint;
        bool cancelled = false;  // not all samples are there
        double rays = 0;         // traced for a sample, mean; 0: not known
        double falls = 0;        // the noise's error since the first pass (FallsBetween)
    };
    std::optional<FilterWork> TakeFilterWork();
    // Ignored if the job was cancelled in between.
    void Succeed(const std::string& name, Outcome outcome, TimePoint now);

    // A share of the units, 0 to 1, chosen by a `salt` that no worker knows, is merged only when
    // two workers gave the same answer. A worker whose answer is odd is quarantined. 0: none.
    void SetCrossCheck(double share, std::uint64_t salt) { checks_.Configure(share, salt); }

    // Bytes of all films under way together: what has no room waits. Unset: as many as there are.
    void SetFilmMemory(std::uint64_t most) { room_.SetMost(most); }

    // --- Workers.
    WorkerId AddWorker(const std::string& name, const std::string& numeric_class, int threads,
                       TimePoint now);
    // Made unique among those that are there.
    const std::string& WorkerName(WorkerId worker) const { return workers_.at(worker).info.name; }
    // Where it runs: work that cost a worker goes to another machine first. Unset: the name that it
    // gave itself.
    void SetMachine(WorkerId worker, const std::string& machine);
    // Its leases go back.
    void RemoveWorker(WorkerId worker);
    // Likewise, of one that did not take its leave: what it was at is held against the jobs. `how`:
    // what is known of its end, "was lost".
    void LoseWorker(WorkerId worker, const std::string& how, TimePoint now);
    // Its last words: it dies of a signal, in this job. `lease`: which it was rendering; 0: it was
    // loading the scene. LoseWorker follows.
    void Crashed(WorkerId worker, const std::string& job, LeaseId lease, int signal);
    // Any message of the worker shows that it is there.
    void Heard(WorkerId worker, TimePoint now);
    // How many leases it wants to hold at once, and how many it says it holds.
    void SetCredits(WorkerId worker, std::uint32_t credits, std::uint32_t held);
    void SceneReady(WorkerId worker, const std::string& job, const std::vector<std::string>& notes,
                    TimePoint now);
    // A problem that is the scene's ends the job. One of this worker's own (`transient`) pauses it
    // for the job; it ends the job when it comes kMaxProblems times and nobody else makes progress.
    void Problem(WorkerId worker, const std::string& job, const std::string& message,
                 bool transient, TimePoint now);
    // Those in quarantine that are not connected are the last ones.
    std::vector<WorkerInfo> Workers(TimePoint now) const;
    // Ends the quarantine of the worker, connected or not. kNotFound if there is none of that name.
    void Release(const std::string& worker);
    std::vector<WorkerId> WorkerIds() const;
    bool KnowsWorker(WorkerId worker) const { return workers_.count(worker) != 0; }

    // --- Leases.
    // The next lease for a worker with credits to spare.
    std::optional<LeaseGrant> NextLease(WorkerId worker, TimePoint now);
    // The task of a lease that is out, else null. Valid until the next call of a method that is not
    // const.
    const TileTask* TaskOf(LeaseId lease) const;
    // Whether such a lease is with the worker.
    bool IsLent(LeaseId lease, WorkerId worker) const;
    // The job and the unit of such a lease.
    std::pair<std::string, std::uint64_t> UnitOf(LeaseId lease) const;
    ResultVerdict AddResult(WorkerId worker, LeaseId lease, const std::string& job,
                            TileResult result, TimePoint now);
    // The task of a unit of a job that still waits for its answer, whoever has it on loan.
    std::optional<TileTask> TaskOfUnit(const std::string& job, std::uint64_t unit) const;
    // The answer to such a unit by a worker whose lease on it is gone: it counts like any other.
    ResultVerdict AddLateResult(WorkerId worker, const std::string& job, std::uint64_t unit,
                                TileResult result, TimePoint now);
    // Adds to the job's merge_seconds, while it is known.
    void CountMergeSeconds(const std::string& job, double seconds);
    // The answer could not even be read.
    ResultVerdict RejectResult(WorkerId worker, LeaseId lease, const std::string& reason,
                               TimePoint now);
    // Nor an answer whose lease is gone.
    void RejectLateResult(WorkerId worker, const std::string& job, const std::string& reason,
                          TimePoint now);
    void ReturnLeases(WorkerId worker, const std::vector<LeaseId>& leases);
    // Leases of the worker that are of no more use, since the last call.
    std::vector<LeaseId> TakeRevoked(WorkerId worker);

    // Workers that are not heard of for so long are taken for gone [kSilentSeconds].
    void SetSilence(double seconds) { silent_seconds_ = seconds; }
    // Late leases and silent workers. A few times a second: a gap of more than five seconds
    // between calls is not held against anyone.
    void Tick(TimePoint now);
    // True if since the last call units came to wait or leases were revoked: ask NextLease and
    // TakeRevoked for every worker.
    bool TakeNews() { return std::exchange(news_, false); }

    // What is seen from outside; of jobs under way and of workers at most so many each, the oldest.
    QueueStatus Status(TimePoint now, std::size_t max_jobs, std::size_t max_workers) const;

  private:
    // What a worker has to do with one job.
    struct Involvement {
        bool scene_ready = false;
        int problems = 0;                      // in a row
        std::uint64_t samples_at_problem = 0;  // samples_done of the job at the first of them
        TimePoint paused_until{};
        TimePoint since{};  // its first lease
    };
    struct LastWords {
        std::string job, how;
        LeaseId lease = 0;  // 0: none
    };
    struct Worker {
        WorkerInfo info;
        std::uint32_t credits = 0, reported_held = 0;
        std::set<LeaseId> leases;       // held, as far as the server knows
        std::uint64_t samples_out = 0;  // of those
        TimePoint last_heard;
        bool silent = false;
        std::map<std::string, Involvement> jobs;
        std::vector<LeaseId> revoked;
        std::optional<FairShare::Key> last;  // whom it worked for
        std::string machine, asked;          // `asked`: the name that it gave itself
        std::optional<LastWords> last_words;
    };
    struct Lease {
        std::string job;
        WorkerId worker = 0;
        std::size_t unit = 0;
        TileTask task;
        std::uint64_t samples = 0;
        FairShare::Charge charge;
        TimePoint issued, expected, deadline;
        bool late = false;       // past its deadline: the unit may go to another worker as well
        bool abandoned = false;  // as late again, or its worker is silent: it counts for nothing
                                 // any more, but an answer is taken if the unit still needs one
        bool alone = false;      // its worker gets nothing else meanwhile
    };
    using Leases = std::map<LeaseId, Lease>;

    Job& Find(const std::string& name);
    const Job& Find(const std::string& name) const;
    static FairShare::Key KeyOf(const Job& job) { return {job.info().priority, job.info().owner}; }
    // The order of jobs: job_queue_order.cpp.
    void Place(Job* job);
    void SetSlack();
    std::optional<LeaseGrant> LendFirst(WorkerId worker, TimePoint now);
    std::optional<LeaseGrant> RaceFirst(WorkerId worker, TimePoint now);
    static FairShare::Charge ChargeFor(const Job& job, std::uint64_t samples);
    static bool MayWorkOn(const Worker& worker, Job* job, TimePoint now);
    // True if another worker than `worker` could do the job's leases.
    bool HasOther(WorkerId worker, const Job& job) const;
    // Work that has cost workers, see LossBook. True if the worker gets nothing else now: it has
    // such work in hand, waits for it with empty hands, or gets it as `grant`.
    bool LendAlone(WorkerId worker, TimePoint now, std::optional<LeaseGrant>* grant);
    // Such work of the job that waits and is this worker's to try.
    std::optional<std::size_t> FindAlone(WorkerId worker, const Job& job) const;
    // Workers on this one's machine were lost over the unit, or over loading the scene, and there
    // are others to try it.
    bool Shuns(WorkerId worker, const Job& job, std::optional<std::size_t> unit) const;
    bool SceneReadyAt(const Worker& worker, const std::string& job) const {
        const auto it = worker.jobs.find(job);
        return it != worker.jobs.end() && it->second.scene_ready;
    }
    bool CouldCheck(const Worker& worker, const Job& job) const;
    // Whether the worker is the one to ask next for an answer to a unit that is cross-checked.
    bool MayVote(WorkerId worker, const Job& job, std::size_t unit) const;
    bool HasOtherVoter(const std::string& voter, const Job& job) const;
    // What counts by now as the answer to the unit; nothing: it waits for another worker's.
    std::optional<CrossChecks::Vote> CrossCheck(WorkerId worker, Job* job, std::size_t unit,
                                                TileResult result, TimePoint now);
    void ConcludeChecks(TimePoint now);
    void Quarantine(const std::string& worker, const std::string& why, TimePoint now);
    // The answer counts: it ends all leases on the unit.
    void Accept(Job* job, std::size_t unit, CrossChecks::Vote answer, TimePoint now);
    void NoteLoss(const std::string& job, const LossBook::Loss& loss, TimePoint now);
    std::optional<LeaseGrant> Lend(WorkerId worker, Job* job, TimePoint now);
    std::optional<std::size_t> FindUnit(WorkerId id, const Job& job) const;
    bool WouldDelay(const Worker& worker, const Job& job, std::uint64_t samples) const;
    std::optional<std::size_t> FindRace(WorkerId id, const Worker& worker, const Job& job,
                                        TimePoint now) const;
    std::optional<std::size_t> FindRace(WorkerId id, const Worker& worker, const Job& job,
                                        bool awaited, TimePoint now) const;
    static WorkerPace PaceOf(const Worker& worker, const Job& job, std::uint64_t samples_before);
    LeaseGrant Issue(WorkerId worker, Job* job, std::size_t unit, TimePoint now);
    static void SetDeadline(const Worker& worker, bool scene_ready, std::uint64_t samples_before,
                            Lease* lease, TimePoint now);
    // True if `worker` is at work on the unit.
    bool Holds(WorkerId worker, const Job& job, std::size_t unit) const;
    void RequeueIfLate(Job* job, std::size_t unit);
    void Abandon(LeaseId id, Lease* lease);
    // Takes the lease out of both tables; the job keeps the unit.
    void Forget(Leases::iterator lease);
    void GiveBack(Leases::iterator lease);
    // All leases on the unit, or of the job, are of no more use.
    void Revoke(const std::set<LeaseId>& leases);
    void RevokeJob(const std::string& job);
    bool HasLeases(const std::string& job) const;
    void ExcuseAbsence(TimePoint now);
    void TakeResult(WorkerId worker, Job* job, std::size_t unit, LeaseId own, TileResult result,
                    TimePoint now);
    ResultVerdict Wrong(Leases::iterator lease, const std::string& reason, TimePoint now);
    void NoteStateOf(Job* job);

    std::map<std::string, std::unique_ptr<Job>> jobs_;
    std::map<std::uint64_t, Job*> by_number_;  // in order of creation
    std::map<std::uint64_t, Job*> active_;     // of those, all that may have work
    std::map<std::uint64_t, Job*> not_over_;   // and those that TakeOver has not told of
    FairShare share_;                          // of jobs that are running
    MemoryRoom room_;
    std::uint64_t starting_ = 0;  // the job that was started last
    std::deque<std::string> to_plan_, to_filter_;
    JobTotals forgotten_;  // of jobs that are
    std::uint64_t results_wrong_ = 0;
    std::map<WorkerId, Worker> workers_;
    Leases leases_;
    LossBook losses_;
    CrossChecks checks_;
    struct Quarantined {
        std::string name, why;
        TimePoint since;
    };
    std::map<std::pair<std::string, std::string>, Quarantined> quarantined_;  // machine, name asked
    std::map<std::string, WorkerId> next_alone_;  // by job: who empties its hands for such work
    std::uint64_t last_number_ = 0;
    WorkerId last_worker_ = 0;
    LeaseId last_lease_ = 0;
    std::optional<TimePoint> last_tick_;
    double silent_seconds_ = kSilentSeconds;
    bool news_ = false;
};

}  // namespace relume::jobs
