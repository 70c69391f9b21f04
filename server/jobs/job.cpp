#include "server/jobs/job.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/base/error.h"
#include "server/jobs/count_answer.h"

namespace relume::jobs {
namespace {

constexpr std::size_t kEventsKeptWhenOver = 16;
constexpr double kProgressSeconds = 0.2;  // between events that only report progress
constexpr std::size_t kMaxNotes = 100;
// Planned and not wholly in the film, where plans need not wait for it.
constexpr std::size_t kMaxOpenPasses = 3;

constexpr std::size_t kMergesAtOnce = 16;  // tiles of a backlog, with each result

}  // namespace

Job::Job(const std::string& name, std::uint64_t number, JobSetup setup, TimePoint now)
    : setup_(std::move(setup)), events_(kEventsKept) {
    info_.name = name;
    info_.number = number;
    info_.owner = setup_.owner;
    info_.priority = setup_.priority;
    info_.samples_budget = setup_.budgets.samples;
    info_.created = now;
    planner_ = std::make_shared<BudgetedPlanner>(std::move(setup_.planner), setup_.budgets,
                                                 setup_.estimators);
    Publish(now);
}

void Job::Hold(const std::string& why, TimePoint now) {
    if (info_.held != why && !IsOver(info_.state)) {
        info_.held = why;
        new_work_ = true;
        Publish(now);
    }
}

bool Job::MergedUnit(std::size_t unit) const {
    if (open_.empty() || unit < open_.front().first_unit) {
        return unit < units_planned_;
    }
    return unit < units_planned_ && PassOf(unit).pass->MergedUnit(Local(unit));
}

bool Job::Awaits(std::size_t unit) const {
    return !open_.empty() && unit >= open_.front().first_unit && unit < units_planned_ &&
           !Done(unit);
}

void Job::Wait(const std::string& why, TimePoint now) {
    if (info_.state == JobState::kQueued && info_.message != why) {
        info_.message = why;
        Publish(now);
    }
}

void Job::Start(TimePoint now) {
    if (info_.state == JobState::kQueued) {
        info_.state = JobState::kRendering;
        info_.message.clear();
        pass_start_ = now;
        Proceed(now);
        Publish(now);
    }
}

Job::OpenPass& Job::PassOf(std::size_t unit) {
    return const_cast<OpenPass&>(std::as_const(*this).PassOf(unit));
}

const Job::OpenPass& Job::PassOf(std::size_t unit) const {
    const auto it = std::ranges::find_if(open_, [&](const OpenPass& p) { return unit < p.end(); });
    RELUME_CHECK(it != open_.end() && unit >= it->first_unit);
    return *it;
}

const Job::Unit& Job::At(std::size_t unit) const {
    static const Unit kUntouched;
    const OpenPass& open = PassOf(unit);
    const auto it = open.units.find(unit - open.first_unit);
    return it == open.units.end() ? kUntouched : it->second;
}

std::optional<std::size_t> Job::FindPending(std::size_t from,
                                            const std::function<bool(std::size_t)>& wanted) const {
    return pending_.Find(from, wanted);
}

std::size_t Job::FirstSpareUnit() const {
    if (open_.empty() || stop_) {
        return units_planned_;
    }
    switch (planner_->View()) {
        case FilmView::kNothing:
            return open_.front().end();
        case FilmView::kLagging:
            return open_.back().first_unit + open_.back().pass->first_cover_unit();
        case FilmView::kWhole:
            break;
    }
    return units_planned_;
}

std::uint64_t Job::SamplesAwaited() const {
    const std::size_t end = FirstSpareUnit();
    std::uint64_t samples = 0;
    for (const OpenPass& open : open_) {
        if (open.end() <= end) {
            samples += open.pass->samples_left();
        } else if (open.first_unit < end) {
            samples += open.pass->samples_left_but_cover();
        }
    }
    return samples;
}

void Job::AddLease(std::size_t unit, LeaseId lease, TimePoint now) {
    if (!first_lease_) {
        first_lease_ = now - FromSeconds(info_.render_seconds);
        pass_start_ = now;
        if (!info_.wait_seconds) {
            info_.wait_seconds = ToSeconds(now - info_.created);
        }
    }
    ++info_.leases_issued;
    auto issued = PassOf(unit).issued[Local(unit)];
    info_.leases_reissued += issued ? 1 : 0;
    issued = true;
    At(unit).leases.insert(lease);
}

void Job::Requeue(std::size_t unit) {
    if (!Done(unit)) {
        new_work_ = pending_.Insert(unit) || new_work_;
    }
}

int Job::Refuse(std::size_t unit, WorkerId worker) {
    At(unit).refused.insert(worker);
    return ++At(unit).bad;
}

void Job::Accept(std::size_t unit, const std::string& worker, TileResult result, TimePoint now) {
    OpenPass& open = PassOf(unit);
    const std::uint64_t samples = Samples(unit);
    speed_.Add(now, samples);
    CountAnswer(worker, samples, result, 1, &info_);
    info_.render_seconds = ToSeconds(now - first_lease_.value_or(now));
    pending_.Erase(unit);
    open.units.erase(Local(unit));
    open.pass->Accept(Local(unit), std::move(result), worker);
    MergeTile(open.pass->TileOf(Local(unit)));
    MergeBacklog();
    Proceed(now);
    if (ToSeconds(now - last_publish_) >= kProgressSeconds) {
        Publish(now);
    }
}

void Job::MergeTile(std::size_t tile) {
    for (const OpenPass& open : open_) {
        const auto before = [&](bool cover, const Pass::Waiting& layer) {
            if (copy_) {
                copy_->Merging(*open.pass, tile, cover, layer, *film_);
            }
        };
        // The newest cover is not for the eyes of the next plan.
        open.pass->Merge(tile, stop_ || &open != &open_.back(), film_.get(), before);
        if (!open.pass->Merged(tile)) {
            return;
        }
    }
}

// A few at a time, so that nobody has to wait for long; all if they are what is waited for.
void Job::MergeBacklog() {
    const bool all = SamplesAwaited() == 0;
    for (std::size_t n = 0; !backlog_.empty() && (all || n < kMergesAtOnce); ++n) {
        MergeTile(backlog_.back());
        backlog_.pop_back();
    }
}

void Job::Proceed(TimePoint now) {
    while (!open_.empty() && open_.front().pass->merged()) {
        EndPass(now);
    }
    if (planning_ == Planning::kNone && MayPlan()) {
        planning_ = Planning::kWanted;
        wants_plan_ = true;
    }
    if (stop_ && open_.empty() && info_.state == JobState::kRendering) {
        info_.audit = Audit();
        ComeToFilter(now);
    }
}

void Job::ComeToFilter(TimePoint now) {
    info_.state = JobState::kFiltering;
    info_.message = stop_->words;
    info_.stop = stop_->reason;
    sampled_ = now;
    copy_.reset();
    last_ = std::make_shared<const Checkpoint>(MakeCheckpoint());
    planner_.reset();
    Publish(now);
}

void Job::EndPass(TimePoint now) {
    const Pass& pass = *open_.front().pass;
    tile_error_.resize(pass.tile_count(), 0);
    double error = 0;
    for (std::size_t tile = 0; tile < tile_error_.size(); ++tile) {
        if (pass.TileError(tile) >= 0) {
            tile_error_[tile] = pass.TileError(tile);
        }
        error += tile_error_[tile];
    }
    info_.relmse = error / static_cast<double>(film_->pixel_count());
    info_.passes.push_back({static_cast<std::uint32_t>(info_.passes.size()), pass.total_samples(),
                            pass.active_pixels(), info_.relmse, ToSeconds(now - pass_start_),
                            open_.front().plan_seconds, open_.front().image_relmse,
                            open_.front().relmse_predicted, pass.unit_count()});
    if (planner_->View() == FilmView::kNothing) {
        errors_.push_back({TotalSamples(info_.passes), info_.relmse});
    }
    pass_start_ = now;
    open_.pop_front();
    Publish(now);
}

LedgerAudit Job::Audit() const {
    LedgerAudit audit;
    for (const PassSummary& pass : info_.passes) {
        audit.ranges += pass.ranges;
    }
    audit.samples = TotalSamples(info_.passes);
    std::uint64_t shares = 0, wrong = 0;
    for (const auto& [name, share] : info_.workers) {
        shares += share.samples;
    }
    for (std::size_t i = 0; i < film_->pixel_count(); ++i) {
        audit.film_samples += film_->NextIndex(i);
        wrong += film_->NextIndex(i) != (*planned_)[i] ? 1 : 0;
    }
    if (wrong > 0) {
        audit.problem = fmt::format("{} pixels hold other samples than were planned", wrong);
    } else if (audit.ranges != units_planned_ || audit.samples != audit.film_samples ||
               audit.samples != info_.samples_done || audit.samples != shares) {
        audit.problem = fmt::format(
            "{} of {} ranges; {} samples planned, {} taken in, {} of workers, {} in the film",
            audit.ranges, units_planned_, audit.samples, info_.samples_done, shares,
            audit.film_samples);
    }
    return audit;
}

bool Job::MayPlan() const {
    if (stop_ || open_.empty()) {
        return !stop_;
    }
    switch (planner_->View()) {
        case FilmView::kNothing:
            return open_.size() < kMaxOpenPasses;
        case FilmView::kLagging:
            return open_.size() == 1 && open_.front().pass->merged_but_cover();
        case FilmView::kWhole:
            break;
    }
    return false;
}

std::optional<PlanWork> Job::TakePlanWork(TimePoint now) {
    if (planning_ != Planning::kWanted || info_.paused) {
        return std::nullopt;
    }
    planning_ = Planning::kRunning;
    PlanWork work;
    work.name = info_.name;
    work.window = setup_.window;
    work.display_width = setup_.display_width;
    work.display_height = setup_.display_height;
    work.tile_size = setup_.tile_size;
    work.pass = passes_planned_;
    work.planner = planner_;
    work.samples_done = info_.samples_done;
    work.samples_per_second = SamplesPerSecond();
    work.seconds = ToSeconds(info_.Used(now));
    work.guide = setup_.guide;
    work.rays = RaysInFilm();
    work.film = film_;
    work.planned = planned_;
    return work;
}

void Job::Planned(PlanResult result, TimePoint now) {
    if (planning_ != Planning::kRunning) {
        return;
    }
    planning_ = Planning::kNone;
    info_.plan_seconds += result.seconds;
    info_.plan_filter_seconds += result.filter_seconds;
    if (!result.failure.empty()) {
        finishing_ ? FinishEarly(now) : Fail(result.failure, now);
        return;
    }
    if (result.film) {
        film_ = std::move(result.film);
    }
    planned_ = std::move(result.planned);
    info_.finish_seconds_predicted =
        std::max(info_.finish_seconds_predicted, result.finish_seconds);
    NoteError(result);
    if (!result.selector.empty()) {
        selector_ = std::make_shared<const std::vector<float>>(std::move(result.selector));
    }
    if (!result.decisions.empty()) {
        decisions_ = std::make_shared<const std::vector<Decision>>(std::move(result.decisions));
    }
    if (result.pass) {
        Open(&result);
    } else {
        stop_ = std::move(result.stop);
    }
    if (!open_.empty()) {
        const Pass& oldest = *open_.front().pass;
        for (std::size_t tile = 0; tile < oldest.tile_count(); ++tile) {
            if (oldest.Waits(tile)) {
                backlog_.push_back(tile);
            }
        }
    }
    if (finishing_) {  // the pass is there when the job is taken up again
        FinishEarly(now);
        return;
    }
    MergeBacklog();
    Proceed(now);
    Publish(now);
}

// Of the newest pass the cover waits: whose of it was quick says nothing.
double Job::RaysInFilm() const {
    if (planner_->View() == FilmView::kNothing) {
        return 0;
    }
    std::uint64_t rays = info_.rays, samples = info_.samples_done;
    for (const OpenPass& open : open_) {
        open.pass->ForEachWaiting([&](const Pass::Waiting& waiting) {
            rays -= waiting.result.rays;
            samples -= waiting.samples;
        });
    }
    return samples > 0 ? static_cast<double>(rays) / static_cast<double>(samples) : 0;
}

// A pass whose units follow on all before it.
Job::OpenPass* Job::OpenWith(std::shared_ptr<Pass> pass) {
    OpenPass& open = open_.emplace_back();
    open.pass = std::move(pass);
    open.first_unit = units_planned_;
    open.unit_count = open.pass->unit_count();
    open.issued.resize(open.unit_count);
    units_planned_ = open.end();
    for (std::size_t unit = open.first_unit; unit < open.end(); ++unit) {
        if (!open.pass->Done(unit - open.first_unit)) {
            pending_.Insert(unit);
        }
    }
    new_work_ = true;
    return &open;
}

void Job::Open(PlanResult* result) {
    OpenPass* open = OpenWith(std::move(result->pass));
    open->plan_seconds = result->seconds;
    open->relmse_predicted = result->expected_error;
    ++passes_planned_;
    samples_planned_ += open->pass->total_samples();
    if (result->last) {
        stop_ = Stop{StopReason::kSamples, kBudgetSpent};
    }
}

void Job::AddNote(const std::string& note, TimePoint now) {
    if (IsOver(info_.state) || info_.notes.size() >= kMaxNotes ||
        std::find(info_.notes.begin(), info_.notes.end(), note) != info_.notes.end()) {
        return;
    }
    info_.notes.push_back(note);
    Publish(now);
}

std::optional<SampledImage> Job::TakeSampled() {
    if (info_.state != JobState::kFiltering || !film_ || info_.paused) {
        return std::nullopt;
    }
    SampledImage sampled{std::move(film_), std::move(last_)};
    Release();
    return sampled;
}

void Job::Succeed(Outcome outcome, TimePoint now) {
    if (IsOver(info_.state)) {
        return;
    }
    info_.outcome = std::move(outcome);
    const bool cancelled = info_.stop == StopReason::kCancelled;
    End(cancelled ? JobState::kCancelled : JobState::kSucceeded, info_.message, now);
}

void Job::End(JobState state, const std::string& message, TimePoint now) {
    if (IsOver(info_.state)) {
        return;
    }
    Unpause(now);
    info_.state = state;
    info_.message = message;
    info_.held.clear();
    info_.ended = now;
    Release();
    Publish(now);
    events_.Trim(kEventsKeptWhenOver);
}

// What takes memory. A plan under way keeps what it needs, and its result is dropped.
void Job::Release() {
    planning_ = Planning::kNone;
    finishing_ = false;
    copy_.reset();
    last_.reset();
    film_.reset();
    planned_.reset();
    open_.clear();
    pending_.clear();
    backlog_.clear();
    selector_ = std::make_shared<std::vector<float>>();
    decisions_ = std::make_shared<std::vector<Decision>>();
    tile_error_ = {};
    planner_.reset();
    setup_.guide = nullptr;
}

void Job::Publish(TimePoint now) {
    last_publish_ = now;
    Expect(now);
    events_.Append(info_);
}

}  // namespace relume::jobs
