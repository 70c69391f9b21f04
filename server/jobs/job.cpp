#include "server/jobs/job.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"

namespace relume::jobs {
namespace {

constexpr std::size_t kEventsKept = 256;
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
    info_.samples_budget = setup_.budgets.samples;
    info_.created = now;
    planner_ = std::make_shared<BudgetedPlanner>(std::move(setup_.planner), setup_.budgets,
                                                 setup_.estimators);
    Publish(now);
}

void Job::Start(TimePoint now) {
    if (info_.state == JobState::kQueued) {
        info_.state = JobState::kRendering;
        pass_start_ = now;
        Proceed(now);
        Publish(now);
    }
}

const Job::OpenPass& Job::PassOf(std::size_t unit) const {
    const auto it = std::ranges::find_if(open_, [&](const OpenPass& p) { return unit < p.end(); });
    RELUME_CHECK(it != open_.end() && unit >= it->first_unit);
    return *it;
}

std::optional<std::size_t> Job::FindPending(std::size_t from,
                                            const std::function<bool(std::size_t)>& wanted) const {
    const auto it = std::find_if(pending_.lower_bound(from), pending_.end(), wanted);
    return it == pending_.end() ? std::nullopt : std::optional(*it);
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
        first_lease_ = pass_start_ = now;
        info_.wait_seconds = ToSeconds(now - info_.created);
    }
    Unit& lent = At(unit);
    ++info_.leases_issued;
    info_.leases_reissued += lent.issued ? 1 : 0;
    lent.issued = true;
    lent.leases.insert(lease);
}

void Job::Requeue(std::size_t unit) {
    if (!Done(unit)) {
        new_work_ = pending_.insert(unit).second || new_work_;
    }
}

int Job::Refuse(std::size_t unit, WorkerId worker) {
    At(unit).refused.insert(worker);
    return ++At(unit).bad;
}

void Job::Accept(std::size_t unit, const std::string& worker, TileResult result, TimePoint now) {
    const OpenPass& open = PassOf(unit);
    const std::uint64_t samples = Samples(unit);
    info_.samples_done += samples;
    speed_.Add(now, samples);
    info_.rays += result.rays;
    for (std::size_t k = 0; k < result.pixels.size(); ++k) {
        info_.bad_samples +=
            static_cast<std::uint64_t>(result.planes[kBadCount * result.pixels.size() + k]);
    }
    WorkerShare& share = info_.workers[worker];
    share.samples += samples;
    share.leases += 1;
    share.busy_seconds += result.seconds;
    info_.busy_seconds += result.seconds;
    info_.render_seconds = ToSeconds(now - first_lease_.value_or(now));
    pending_.erase(unit);
    open.pass->Accept(Local(unit), std::move(result));
    MergeTile(open.pass->TileOf(Local(unit)));
    MergeBacklog();
    Proceed(now);
    if (ToSeconds(now - last_publish_) >= kProgressSeconds) {
        Publish(now);
    }
}

void Job::MergeTile(std::size_t tile) {
    for (const OpenPass& open : open_) {
        // The newest cover is not for the eyes of the next plan.
        open.pass->Merge(tile, stop_ || &open != &open_.back(), film_.get());
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
    if (stop_ && open_.empty()) {
        info_.state = JobState::kFiltering;
        info_.message = stop_->words;
        info_.stop = stop_->reason;
        sampled_ = now;
        planner_.reset();
        Publish(now);
    }
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
                            open_.front().relmse_predicted});
    if (planner_->View() == FilmView::kNothing) {
        std::uint64_t samples = 0;
        for (const auto& p : info_.passes) {
            samples += p.samples;
        }
        errors_.push_back({samples, info_.relmse});
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
    if (planning_ != Planning::kWanted) {
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
    work.seconds = ToSeconds(now - info_.created);
    work.guide = setup_.guide;
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
        Fail(result.failure, now);
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
        selector_ = std::move(result.selector);
    }
    if (!result.decisions.empty()) {
        decisions_ = std::move(result.decisions);
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
    MergeBacklog();
    Proceed(now);
    Publish(now);
}

// The estimate that a plan began with is of the passes before it.
void Job::NoteError(const PlanResult& result) {
    if (!result.error) {
        return;
    }
    errors_.push_back(*result.error);
    (open_.empty() ? info_.passes.back().image_relmse : open_.back().image_relmse) =
        result.error->error;
    if (setup_.estimators.error) {
        info_.image_relmse = result.error->error;
    }
}

double Job::SamplesPerSecond() const {
    const double speed = speed_.Get().mean;
    return speed > 0 || info_.render_seconds <= 0
               ? speed
               : static_cast<double>(info_.samples_done) / info_.render_seconds;
}

ForecastInput Job::Prospects(TimePoint now) const {
    ForecastInput input;
    input.budgets = setup_.budgets;
    if (stop_) {
        input.budgets.samples = samples_planned_;
    }
    input.pixels = setup_.window.area();
    input.done = info_.samples_done;
    input.seconds = ToSeconds(now - info_.created);
    input.speed = speed_.Get();
    input.finish_seconds = info_.finish_seconds_predicted;
    input.errors = errors_;
    input.filtered = setup_.estimators.filtered;
    return input;
}

std::optional<double> Job::SamplesLeft(TimePoint now) const {
    return active() ? jobs::SamplesLeft(Prospects(now)) : 0;
}

// What is to be expected from now on.
void Job::Expect(TimePoint now) {
    info_.updated = now;
    info_.eta.reset();
    if (info_.state == JobState::kFiltering && sampled_) {
        if (info_.finish_seconds_predicted > 0) {
            const double left =
                std::max(0.0, info_.finish_seconds_predicted - ToSeconds(now - *sampled_));
            info_.eta = Eta{left, left, left};
        }
        return;
    }
    if (info_.state != JobState::kRendering) {
        return;
    }
    const ForecastInput input = Prospects(now);
    info_.eta = EstimateEta(input);
    if (input.speed.mean > 0 && !errors_.empty()) {
        info_.forecast = Forecast(input);
        if (!info_.predicted && info_.eta) {
            const double gone = input.seconds;
            info_.predicted =
                Eta{gone + info_.eta->seconds, gone + info_.eta->low, gone + info_.eta->high};
        }
    }
}

void Job::Open(PlanResult* result) {
    OpenPass& open = open_.emplace_back();
    open.pass = std::move(result->pass);
    open.first_unit = units_planned_;
    open.units.resize(open.pass->unit_count());
    open.plan_seconds = result->seconds;
    for (std::size_t unit = open.first_unit; unit < open.end(); ++unit) {
        pending_.insert(pending_.end(), unit);
    }
    new_work_ = true;
    ++passes_planned_;
    units_planned_ = open.end();
    samples_planned_ += open.pass->total_samples();
    open.relmse_predicted = result->expected_error;
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
    if (info_.state != JobState::kFiltering || !film_) {
        return std::nullopt;
    }
    SampledImage sampled{std::move(film_), std::move(selector_), std::move(decisions_)};
    Release();
    return sampled;
}

void Job::Succeed(Outcome outcome, TimePoint now) {
    if (IsOver(info_.state)) {
        return;
    }
    info_.outcome = std::move(outcome);
    End(JobState::kSucceeded, info_.message, now);
}

void Job::End(JobState state, const std::string& message, TimePoint now) {
    if (IsOver(info_.state)) {
        return;
    }
    info_.state = state;
    info_.message = message;
    info_.ended = now;
    Release();
    Publish(now);
    events_.Trim(kEventsKeptWhenOver);
}

// What takes memory. A plan under way keeps what it needs, and its result is dropped.
void Job::Release() {
    planning_ = Planning::kNone;
    film_.reset();
    planned_.reset();
    open_.clear();
    pending_.clear();
    backlog_.clear();
    selector_ = {};
    decisions_ = {};
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
