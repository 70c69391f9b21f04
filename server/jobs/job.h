#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/film/film.h"
#include "server/jobs/checkpoint.h"
#include "server/jobs/event_log.h"
#include "server/jobs/film_copy.h"
#include "server/jobs/job_info.h"
#include "server/jobs/pass.h"
#include "server/jobs/plan_work.h"
#include "server/jobs/planner.h"
#include "server/jobs/speed_meter.h"
#include "server/jobs/unit_set.h"

namespace relume::jobs {

using WorkerId = std::uint64_t;  // from 1
using LeaseId = std::uint64_t;   // from 1

// What a job is to be made of.
struct JobSetup {
    TileRect window;
    int display_width = 0, display_height = 0;
    int tile_size = 32;
    bool keep_samples = false;  // in the film
    std::uint64_t memory = 0;   // bytes that it takes from its start to its end
    std::string owner;          // as in JobInfo
    int priority = 0;
    Budgets budgets;
    Estimators estimators;
    std::shared_ptr<Planner> planner;
    Guide guide;  // of the planner; empty: the image is not filtered
};

// A job's samples, all of them, with what its planner said last of where they went.
struct SampledImage {
    std::shared_ptr<const Film> film;
    std::shared_ptr<const Checkpoint> checkpoint;
};

// What is known of a job from an earlier run of the server.
struct SavedJob {
    JobInfo info;
    std::uint64_t last_event = 0;          // none had a higher number
    bool cancelled = false;                // and to be finished with what there is
    std::optional<Checkpoint> checkpoint;  // unset: it starts anew, or is over
    std::shared_ptr<Film> film;            // of the checkpoint
};

// One job: its film, the passes that are planned and not wholly in it, and which of their units are
// lent, wait or are done. It knows leases and workers by number only; JobQueue decides who gets
// what. Not thread-safe.
//
// A unit's number is its own among all passes: in order of issue, which is pass by pass, the cover
// last. Results are merged in that order pixel by pixel. When the next pass is planned the film
// holds what the planner's View says, and nothing more, so that its bits depend on the plans alone.
class Job {
  public:
    Job(const std::string& name, std::uint64_t number, JobSetup setup, TimePoint now);
    // One that goes on, or is over. Of one without a checkpoint that is not, only the time that it
    // has used is kept. Throws kDataLoss if the parts of the checkpoint do not fit.
    Job(SavedJob saved, JobSetup setup, TimePoint now);
    // Makes a job that is over go on from its last checkpoint, within the setup's budgets.
    // Throws as above, and leaves the job as it was.
    void Extend(Checkpoint checkpoint, std::shared_ptr<Film> film, JobSetup setup, TimePoint now);

    const JobInfo& info() const { return info_; }
    const EventLog& events() const { return events_; }
    // Asks for samples, or may come to.
    bool active() const {
        return (info_.state == JobState::kQueued || info_.state == JobState::kRendering) &&
               !finishing_;
    }
    // Gets leases, if it has any that wait.
    bool running() const { return active() && !info_.paused && info_.held.empty(); }
    // Has taken its film's memory, and has no leases to give yet.
    bool starting() const {
        return running() && info_.state == JobState::kRendering && passes_planned_ == 0 && !stop_;
    }

    // Bytes that it takes now, or would once started.
    std::uint64_t memory() const { return setup_.memory; }
    bool takes_memory() const {
        return info_.state == JobState::kRendering || info_.state == JobState::kFiltering;
    }

    // Tells why it is not started yet.
    void Wait(const std::string& why, TimePoint now);
    // Asks for the first pass, on the first call alone; the film's memory is not taken before.
    void Start(TimePoint now);

    // The next pass is to be planned, as RunPlan does; each is handed out once.
    std::optional<PlanWork> TakePlanWork(TimePoint now);
    // What came of it. Ignored if the job is over.
    void Planned(PlanResult result, TimePoint now);
    // True if a plan came to be wanted since the last call.
    bool TakeWantsPlan() { return std::exchange(wants_plan_, false); }

    TileTask Task(std::size_t unit) const {
        TileTask task = PassOf(unit).pass->Task(Local(unit));
        task.keep_samples = setup_.keep_samples;
        return task;
    }
    std::uint64_t Samples(std::size_t unit) const {
        return PassOf(unit).pass->Samples(Local(unit));
    }
    // The first unit that waits, from `from` on, and for which `wanted` says yes. Take follows.
    std::optional<std::size_t> FindPending(std::size_t from,
                                           const std::function<bool(std::size_t)>& wanted) const;
    void Take(std::size_t unit) { pending_.Erase(unit); }
    // The next plan does not wait for units from here on.
    std::size_t FirstSpareUnit() const;
    // Samples that are still awaited for the next plan; for the end of the job, if that comes
    // first.
    std::uint64_t SamplesAwaited() const;

    // Units that wait to be lent.
    std::size_t units_waiting() const { return pending_.size(); }
    // Pixels that get samples in the newest pass; 0 when no pass is open.
    std::uint64_t active_pixels() const {
        return open_.empty() ? 0 : open_.back().pass->active_pixels();
    }
    // Samples that are still to be rendered, as of the forecast; nothing if no budget tells.
    std::optional<double> SamplesLeft(TimePoint now) const;

    // Records a lease on the unit and counts it.
    void AddLease(std::size_t unit, LeaseId lease, TimePoint now);
    void DropLease(std::size_t unit, LeaseId lease) { At(unit).leases.erase(lease); }
    // The unit waits again. Answers to leases that are out on it are still welcome.
    void Requeue(std::size_t unit);
    const std::set<LeaseId>& Leases(std::size_t unit) const { return At(unit).leases; }

    // Notes that `worker` gave a wrong answer to the unit; how many it has had by now.
    int Refuse(std::size_t unit, WorkerId worker);
    bool Refused(std::size_t unit, WorkerId worker) const {
        return At(unit).refused.count(worker) != 0;
    }

    // Merges the checked answer to a unit that is not done, or keeps it until its turn comes.
    void Accept(std::size_t unit, const std::string& worker, TileResult result, TimePoint now);
    // True if units came to wait since the last call: there is work for those who are idle.
    bool TakeNewWork() { return std::exchange(new_work_, false); }

    void CountDuplicate() { ++info_.results_duplicate; }
    void CountSave(double seconds) { info_.save_seconds += seconds; }
    void CountMergeSeconds(double seconds) { info_.merge_seconds += seconds; }
    void SetNumericClass(const std::string& numeric_class) { info_.numeric_class = numeric_class; }
    // Kept once each.
    void AddNote(const std::string& note, TimePoint now);

    // Why the job makes no progress for now, "" if it does. Leases are not given out meanwhile.
    void Hold(const std::string& why, TimePoint now);

    // Until Resume no leases are given out, no pass is planned and the image is not filtered; what
    // workers have in hand is still taken. The time does not count. kFailedPrecondition if it is
    // over, or is being filtered.
    void Pause(TimePoint now);
    void Resume(TimePoint now);
    void SetPriority(int priority, TimePoint now);

    // Begins a copy of the film, see FilmCopy, and answers with what belongs to it as of now. Null
    // if there is no film, a plan is being made, or another copy is under way. Valid until the next
    // call of a method that is not const.
    const Checkpoint* BeginCopy(FilmCopy::Sink sink);
    // Hands on more tiles, at most `count`; false if there is no copy, or no more of it.
    bool CopyTiles(std::size_t count);
    // After that: what belongs to all the tiles that were handed on. Nothing if there was no copy.
    std::optional<Checkpoint> TakeCopied();
    void DropCopy() { copy_.reset(); }
    // The unit is in the film, in that of the last BeginCopy if it is called right after.
    bool MergedUnit(std::size_t unit) const;
    // A unit that was planned and has no answer yet.
    bool Awaits(std::size_t unit) const;

    // What a job that has come to FILTERING has sampled, once.
    std::optional<SampledImage> TakeSampled();
    // Ends the job, unless it is over.
    void Succeed(Outcome outcome, TimePoint now);
    void Fail(const std::string& message, TimePoint now);
    void Cancel(TimePoint now) { End(JobState::kCancelled, kCancelledWords, now); }
    // Asks for no more samples: those that are in the film become the image, after which the job is
    // kCancelled. Without any as Cancel; nothing happens if all samples are in.
    void CancelKeepingImage(TimePoint now);

  private:
    struct Unit {
        std::set<LeaseId> leases;    // that may still be answered
        std::set<WorkerId> refused;  // gave wrong answers
        int bad = 0;
    };
    struct OpenPass {
        std::shared_ptr<Pass> pass;
        std::size_t first_unit = 0;
        std::size_t unit_count = 0;
        std::vector<bool> issued;           // at least once, by unit
        std::map<std::size_t, Unit> units;  // that are not done, and of which there is something
        double plan_seconds = 0;
        std::optional<double> image_relmse, relmse_predicted;  // as in PassSummary

        std::size_t end() const { return first_unit + unit_count; }
    };
    enum class Planning { kNone, kWanted, kRunning };
    static constexpr std::size_t kEventsKept = 256;
    static constexpr const char* kCancelledWords = "cancelled";

    // The pass of a unit, and the unit's place in it.
    const OpenPass& PassOf(std::size_t unit) const;
    OpenPass& PassOf(std::size_t unit);
    std::size_t Local(std::size_t unit) const { return unit - PassOf(unit).first_unit; }
    const Unit& At(std::size_t unit) const;
    Unit& At(std::size_t unit) { return PassOf(unit).units[Local(unit)]; }
    bool Done(std::size_t unit) const { return PassOf(unit).pass->Done(Local(unit)); }

    Checkpoint MakeCheckpoint() const;
    void Restore(Checkpoint checkpoint, std::shared_ptr<Film> film);
    OpenPass* OpenWith(std::shared_ptr<Pass> pass);
    void Open(PlanResult* result);
    void MergeTile(std::size_t tile);
    void MergeBacklog();
    // Ends passes that are merged, asks for a plan, comes to FILTERING: whatever has its turn.
    void Proceed(TimePoint now);
    void ComeToFilter(TimePoint now);
    void FinishEarly(TimePoint now);
    void Unpause(TimePoint now);
    void EndPass(TimePoint now);
    LedgerAudit Audit() const;
    bool MayPlan() const;
    void NoteError(const PlanResult& result);
    ForecastInput Prospects(TimePoint now) const;
    void Expect(TimePoint now);
    // Measured, else over all the time that it has rendered; 0: nothing is known.
    double SamplesPerSecond() const;
    // Traced for a sample that the next plan may look at, mean; 0: not known.
    double RaysInFilm() const;
    void Release();
    void End(JobState state, const std::string& message, TimePoint now);
    void Publish(TimePoint now);

    JobSetup setup_;
    std::shared_ptr<BudgetedPlanner> planner_;
    JobInfo info_;
    EventLog events_;
    TimePoint last_publish_;

    std::shared_ptr<Film> film_;
    std::shared_ptr<const std::vector<std::uint32_t>> planned_;  // samples of each pixel
    std::deque<OpenPass> open_;                                  // oldest first
    UnitSet pending_;                                            // units to be lent
    std::uint32_t passes_planned_ = 0;
    std::size_t units_planned_ = 0;
    std::uint64_t samples_planned_ = 0;
    Planning planning_ = Planning::kNone;
    std::optional<Stop> stop_;  // no more plans
    std::vector<ErrorPoint>
        errors_;  // as planned by, or of passes that ended where plans don't tell
    SpeedMeter speed_;
    std::optional<TimePoint> sampled_;  // when the last sample was in
    std::shared_ptr<const std::vector<float>> selector_ = std::make_shared<std::vector<float>>();
    std::shared_ptr<const std::vector<Decision>> decisions_ =
        std::make_shared<std::vector<Decision>>();
    std::shared_ptr<const Checkpoint> last_;  // when all samples are in
    std::optional<FilmCopy> copy_;
    std::vector<std::size_t> backlog_;  // tiles whose results waited for the plan
    std::vector<double> tile_error_;    // sums of EstimateRelMSE, after the last pass that ended
    std::optional<TimePoint> first_lease_;  // less the time rendered before a restart
    TimePoint pass_start_;
    bool new_work_ = false, wants_plan_ = false;
    bool finishing_ = false;  // to be finished with what there is, after the plan under way
};

}  // namespace relume::jobs
