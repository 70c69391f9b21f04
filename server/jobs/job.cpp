#include "server/jobs/job.h"

#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <utility>

#include "core/base/error.h"

namespace relume::jobs {
namespace {

constexpr std::size_t kEventsKept = 256;
constexpr std::size_t kEventsKeptWhenOver = 16;
constexpr double kProgressSeconds = 0.2;  // between events that only report progress
constexpr std::size_t kMaxNotes = 100;

}  // namespace

Job::Job(const std::string& name, std::uint64_t number, JobSetup setup, TimePoint now)
    : setup_(std::move(setup)), events_(kEventsKept) {
    info_.name = name;
    info_.number = number;
    info_.samples_budget = setup_.budget;
    info_.created = now;
    Publish(now);
}

bool Job::Start(TimePoint now) {
    if (info_.state != JobState::kQueued) {
        return info_.state == JobState::kRendering;
    }
    try {
        film_ = std::make_shared<Film>(setup_.window, setup_.display_width, setup_.display_height);
        first_.assign(film_->pixel_count(), 0);
    } catch (const std::bad_alloc&) {
        Fail(fmt::format(
                 "the server lacks the memory for {}x{} pixels; choose a smaller --size or --crop",
                 setup_.window.width(), setup_.window.height()),
             now);
        return false;
    }
    info_.state = JobState::kRendering;
    PlanPass(now);
    return info_.state == JobState::kRendering;
}

std::optional<std::size_t> Job::TakePending(const std::function<bool(std::size_t)>& wanted) {
    while (!pending_.empty() && pass_->Done(pending_.front())) {
        pending_.pop_front();
    }
    for (auto it = pending_.begin(); it != pending_.end(); ++it) {
        const std::size_t unit = *it;
        if (!pass_->Done(unit) && wanted(unit)) {
            pending_.erase(it);
            units_[unit].pending = false;
            return unit;
        }
    }
    return std::nullopt;
}

void Job::AddLease(std::size_t unit, LeaseId lease, TimePoint now) {
    if (!first_lease_) {
        first_lease_ = now;
    }
    ++info_.leases_issued;
    info_.leases_reissued += units_[unit].issued ? 1 : 0;
    units_[unit].issued = true;
    units_[unit].leases.insert(lease);
}

void Job::Requeue(std::size_t unit) {
    if (!units_[unit].pending && !pass_->Done(unit)) {
        units_[unit].pending = true;
        pending_.push_front(unit);
        new_work_ = true;
    }
}

int Job::Refuse(std::size_t unit, WorkerId worker) {
    units_[unit].refused.insert(worker);
    return ++units_[unit].bad;
}

void Job::Accept(std::size_t unit, const std::string& worker, TileResult result, TimePoint now) {
    const std::uint64_t samples = pass_->Samples(unit);
    info_.samples_done += samples;
    info_.rays += result.rays;
    for (std::size_t k = 0; k < result.pixels.size(); ++k) {
        info_.bad_samples +=
            static_cast<std::uint64_t>(result.planes[kBadCount * result.pixels.size() + k]);
    }
    WorkerShare& share = info_.workers[worker];
    share.samples += samples;
    share.leases += 1;
    share.busy_seconds += result.seconds;
    info_.render_seconds = ToSeconds(now - first_lease_.value_or(now));
    pass_->Accept(unit, std::move(result), film_.get());
    if (pass_->complete()) {
        EndPass(now);
    } else if (ToSeconds(now - last_publish_) >= kProgressSeconds) {
        Publish(now);
    }
}

void Job::EndPass(TimePoint now) {
    info_.relmse = film_->EstimateRelMSE();
    info_.passes.push_back({static_cast<std::uint32_t>(info_.passes.size()), pass_->total_samples(),
                            pass_->active_pixels(), info_.relmse, ToSeconds(now - pass_start_)});
    planned_samples_ += pass_->total_samples();
    first_ = pass_->NextFirst();
    PlanPass(now);
}

void Job::PlanPass(TimePoint now) {
    try {
        const std::uint64_t left = setup_.budget - std::min(setup_.budget, planned_samples_);
        Plan plan =
            left > 0 ? setup_.planner->NextPass({*film_, left}) : Plan{{}, kBudgetSpent, {}, {}};
        if (plan.counts.empty()) {
            info_.state = JobState::kFiltering;
            info_.message = plan.reason;
            pass_.reset();
            units_.clear();
            pending_.clear();
            setup_.planner.reset();
        } else {
            pass_.emplace(setup_.window, setup_.tile_size, first_, std::move(plan.counts));
            if (pass_->total_samples() == 0 || pass_->total_samples() > left) {
                throw Error(ErrorCode::kInternal,
                            fmt::format("sampler planned {} samples with {} left",
                                        pass_->total_samples(), left));
            }
            units_.assign(pass_->unit_count(), Unit());
            pending_.clear();
            for (std::size_t unit = 0; unit < units_.size(); ++unit) {
                pending_.push_back(unit);
            }
            pass_start_ = now;
            new_work_ = true;
        }
    } catch (const std::bad_alloc&) {
        Fail("the server ran out of memory while it planned a pass; choose a smaller --size", now);
        return;
    } catch (const Error& error) {
        Fail(error.what(), now);
        return;
    }
    Publish(now);
}

void Job::AddNote(const std::string& note, TimePoint now) {
    if (IsOver(info_.state) || info_.notes.size() >= kMaxNotes ||
        std::find(info_.notes.begin(), info_.notes.end(), note) != info_.notes.end()) {
        return;
    }
    info_.notes.push_back(note);
    Publish(now);
}

std::shared_ptr<const Film> Job::TakeFilm() {
    return info_.state == JobState::kFiltering ? std::move(film_) : nullptr;
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
    film_.reset();
    pass_.reset();
    units_.clear();
    pending_.clear();
    setup_.planner.reset();
    Publish(now);
    events_.Trim(kEventsKeptWhenOver);
}

void Job::Publish(TimePoint now) {
    last_publish_ = now;
    events_.Append(info_);
}

}  // namespace relume::jobs
