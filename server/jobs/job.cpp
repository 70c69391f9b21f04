#include "server/jobs/job.h"

#include <algorithm>
#include <utility>

#include "core/base/error.h"

namespace relume::jobs {
namespace {

constexpr std::size_t kEventsKeptWhenOver = 16;
constexpr std::size_t kMaxNotes = 100;
// Planned and not wholly in the film, where plans need not wait for it.
constexpr std::size_t kMaxOpenPasses = 3;

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
