#include <fmt/format.h>

#include "core/base/error.h"
#include "server/jobs/job.h"

// Of Job: what clients ask of it while it is under way.
namespace relume::jobs {
namespace {

[[noreturn]] void RefuseCall(const std::string& message) {
    throw Error(ErrorCode::kFailedPrecondition, message);
}

}  // namespace

void Job::Pause(TimePoint now) {
    if (IsOver(info_.state)) {
        RefuseCall(fmt::format("{} is over; there is nothing to pause", info_.name));
    }
    if (finishing_ || (info_.state == JobState::kFiltering && !film_)) {
        RefuseCall(fmt::format(
            "{} has its samples and is being filtered; wait for it, or `relume cancel --discard` "
            "it",
            info_.name));
    }
    if (!info_.paused) {
        info_.paused = now;
        Publish(now);
    }
}

void Job::Resume(TimePoint now) {
    if (IsOver(info_.state)) {
        RefuseCall(fmt::format("{} is over; `relume extend` adds samples to it", info_.name));
    }
    if (!info_.paused) {
        return;
    }
    Unpause(now);
    new_work_ = true;
    wants_plan_ = wants_plan_ || planning_ == Planning::kWanted;
    Publish(now);
}

// The time in between does not count.
void Job::Unpause(TimePoint now) {
    if (info_.paused) {
        const Duration idle = now - *info_.paused;
        info_.created += idle;
        info_.down += idle;
        info_.paused.reset();
    }
}

void Job::SetPriority(int priority, TimePoint now) {
    if (IsOver(info_.state)) {
        RefuseCall(fmt::format("{} is over; its priority is of no use", info_.name));
    }
    if (info_.priority != priority) {
        info_.priority = priority;
        new_work_ = true;
        Publish(now);
    }
}

void Job::CancelKeepingImage(TimePoint now) {
    if (IsOver(info_.state) || finishing_) {
        return;
    }
    Unpause(now);
    if (info_.state == JobState::kFiltering) {
        return;  // its image is due anyway
    }
    if (!film_ || film_->TotalSamples() + film_->TotalBadSamples() == 0) {
        Cancel(now);
        return;
    }
    info_.stop = StopReason::kCancelled;
    finishing_ = true;
    pending_.clear();
    if (planning_ == Planning::kRunning) {
        info_.message = kCancelledWords;  // the plan reads the film, and the planner goes on
        Publish(now);
    } else {
        FinishEarly(now);
    }
}

// What waits for its turn in the film is dropped, and not counted.
void Job::FinishEarly(TimePoint now) {
    while (!backlog_.empty()) {
        MergeTile(backlog_.back());
        backlog_.pop_back();
    }
    planning_ = Planning::kNone;
    // Only now: with a stop, MergeTile would merge what the next plan is not to see, should the job
    // be taken up again.
    stop_ = Stop{StopReason::kCancelled, kCancelledWords};
    ComeToFilter(now);
    const JobInfo& in_film = last_->info;
    info_.samples_done = in_film.samples_done;
    info_.rays = in_film.rays;
    info_.bad_samples = in_film.bad_samples;
    info_.workers = in_film.workers;
    info_.busy_seconds = in_film.busy_seconds;
    open_.clear();
    pending_.clear();
    finishing_ = false;
    Publish(now);
}

void Job::Fail(const std::string& message, TimePoint now) {
    if (info_.stop == StopReason::kCancelled) {
        End(JobState::kCancelled, fmt::format("{}; no image: {}", kCancelledWords, message), now);
    } else {
        End(JobState::kFailed, message, now);
    }
}

}  // namespace relume::jobs
