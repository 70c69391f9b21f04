#include <algorithm>
#include <tuple>
#include <utility>

#include "core/base/error.h"
#include "server/jobs/count_answer.h"
#include "server/jobs/job.h"

// Of Job: what is kept of it on a disk, and how it goes on from there.
namespace relume::jobs {

Job::Job(SavedJob saved, JobSetup setup, TimePoint now)
    : setup_(std::move(setup)),
      info_(std::move(saved.info)),
      events_(kEventsKept, saved.last_event) {
    info_.owner = setup_.owner;
    info_.priority = setup_.priority;
    info_.samples_budget = setup_.budgets.samples;
    info_.held.clear();
    info_.eta.reset();
    if (IsOver(info_.state)) {
        Release();
        Publish(now);
        return;
    }
    ++info_.restarts;
    planner_ = std::make_shared<BudgetedPlanner>(std::move(setup_.planner), setup_.budgets,
                                                 setup_.estimators);
    if (saved.checkpoint) {
        Restore(std::move(*saved.checkpoint), std::move(saved.film));
    } else {
        JobInfo fresh;
        fresh.name = info_.name;
        fresh.number = info_.number;
        fresh.owner = info_.owner;
        fresh.priority = info_.priority;
        fresh.paused = info_.paused;
        fresh.samples_budget = info_.samples_budget;
        fresh.created = info_.created;
        fresh.down = info_.down;
        fresh.restarts = info_.restarts;
        info_ = std::move(fresh);
    }
    if (saved.cancelled) {
        CancelKeepingImage(now);
    } else if (film_) {
        Proceed(now);
    }
    Publish(now);
}

void Job::Extend(Checkpoint checkpoint, std::shared_ptr<Film> film, JobSetup setup, TimePoint now) {
    const auto before = std::make_tuple(info_, planner_, setup_);
    setup_ = std::move(setup);
    planner_ = std::make_shared<BudgetedPlanner>(std::move(setup_.planner), setup_.budgets,
                                                 setup_.estimators);
    checkpoint.stop.reset();
    JobInfo saved = std::move(checkpoint.info);
    try {
        Restore(std::move(checkpoint), std::move(film));
    } catch (...) {
        std::tie(info_, planner_, setup_) = before;
        Release();
        throw;
    }
    // A film older than the job's end, should the last one not have been saved, lacks samples that
    // were counted then, and will be again.
    info_.samples_done = saved.samples_done;
    info_.rays = saved.rays;
    info_.bad_samples = saved.bad_samples;
    info_.relmse = saved.relmse;
    info_.passes = std::move(saved.passes);
    info_.workers = std::move(saved.workers);
    info_.busy_seconds = saved.busy_seconds;
    info_.owner = setup_.owner;
    info_.priority = setup_.priority;
    const Duration idle = now - info_.ended.value_or(now);
    info_.created += idle;
    info_.down += idle;
    info_.samples_budget = setup_.budgets.samples;
    info_.ended.reset();
    info_.outcome.reset();
    info_.audit.reset();
    info_.stop.reset();
    info_.message.clear();
    info_.predicted.reset();
    info_.state = JobState::kRendering;
    Proceed(now);
    Publish(now);
}

Checkpoint Job::MakeCheckpoint() const {
    Checkpoint c;
    c.info = info_;
    c.window = setup_.window;
    c.display_width = setup_.display_width;
    c.display_height = setup_.display_height;
    c.tile_size = setup_.tile_size;
    c.passes_planned = passes_planned_;
    c.units_planned = units_planned_;
    c.samples_planned = samples_planned_;
    c.stop = stop_;
    c.errors = errors_;
    c.tile_error = tile_error_;
    c.planner = planner_->Save();
    c.planned = planned_;
    c.selector = selector_;
    c.decisions = decisions_;
    for (const OpenPass& open : open_) {
        OpenPassState& state = c.open.emplace_back();
        state.plan = open.pass->plan();
        state.plan_seconds = open.plan_seconds;
        state.image_relmse = open.image_relmse;
        state.relmse_predicted = open.relmse_predicted;
        state.samples = open.pass->total_samples();
        state.ranges = open.pass->unit_count();
        state.merged_samples = open.pass->merged_samples();
        for (std::size_t tile = 0; tile < open.pass->tile_count(); ++tile) {
            state.merged.push_back(open.pass->MergedLayers(tile));
            state.error.push_back(open.pass->TileError(tile));
        }
        open.pass->ForEachWaiting([&](const Pass::Waiting& waiting) {
            CountAnswer(waiting.worker, waiting.samples, waiting.result, -1, &c.info);
        });
    }
    return c;
}

void Job::Restore(Checkpoint c, std::shared_ptr<Film> film) {
    const auto pixels = setup_.window.area();
    if (!film || c.window != setup_.window || c.tile_size != setup_.tile_size ||
        film->window() != setup_.window || c.planned->size() != pixels) {
        throw Error(ErrorCode::kDataLoss, "a saved film does not fit its job");
    }
    planner_->Restore(c.planner);
    film_ = std::move(film);
    planned_ = std::move(c.planned);
    selector_ = std::move(c.selector);
    decisions_ = std::move(c.decisions);
    passes_planned_ = c.passes_planned;
    units_planned_ = c.units_planned;
    samples_planned_ = c.samples_planned;
    stop_ = std::move(c.stop);
    errors_ = std::move(c.errors);
    tile_error_ = std::move(c.tile_error);
    std::vector<std::shared_ptr<Pass>> passes;
    std::size_t units = 0;
    for (const OpenPassState& state : c.open) {
        passes.push_back(std::make_shared<Pass>(setup_.window, setup_.tile_size, state.plan));
        passes.back()->Restore(state.merged, state.error);
        units += passes.back()->unit_count();
    }
    if (units > units_planned_) {
        throw Error(ErrorCode::kDataLoss, "a saved job has more units than were planned");
    }
    units_planned_ -= units;
    for (std::size_t i = 0; i < passes.size(); ++i) {
        OpenPass* open = OpenWith(std::move(passes[i]));
        open->plan_seconds = c.open[i].plan_seconds;
        open->image_relmse = c.open[i].image_relmse;
        open->relmse_predicted = c.open[i].relmse_predicted;
    }
    info_.state = JobState::kRendering;
}

const Checkpoint* Job::BeginCopy(FilmCopy::Sink sink) {
    if (!film_ || planning_ == Planning::kRunning || info_.state != JobState::kRendering || copy_) {
        return nullptr;
    }
    std::vector<std::shared_ptr<const Pass>> passes;
    for (const OpenPass& open : open_) {
        passes.push_back(open.pass);
    }
    copy_.emplace(MakeCheckpoint(), std::move(passes), std::move(sink));
    return &copy_->checkpoint();
}

bool Job::CopyTiles(std::size_t count) {
    if (!copy_) {
        return false;
    }
    for (std::size_t n = 0; n < count; ++n) {
        if (!copy_->TakeNext(*film_)) {
            return false;
        }
    }
    return true;
}

std::optional<Checkpoint> Job::TakeCopied() {
    if (!copy_) {
        return std::nullopt;
    }
    Checkpoint checkpoint = copy_->TakeCheckpoint();
    copy_.reset();
    return checkpoint;
}

}  // namespace relume::jobs
