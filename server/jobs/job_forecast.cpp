#include "server/jobs/job.h"

#include <algorithm>

// Of Job: what is to be expected of it.
namespace relume::jobs {

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
    input.seconds = ToSeconds(info_.Used(now));
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
    if (info_.paused) {
        return;
    }
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

}  // namespace relume::jobs
