#include "server/rpc/job_message.h"

namespace relume::server {
namespace {

void SetTime(std::chrono::system_clock::time_point time, google::protobuf::Timestamp* message) {
    const auto nanos =
        std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
    message->set_seconds(nanos / 1'000'000'000);
    message->set_nanos(static_cast<int>(nanos % 1'000'000'000));
}

v1::JobState StateToProto(jobs::JobState state) {
    switch (state) {
        case jobs::JobState::kQueued:
            return v1::JOB_STATE_QUEUED;
        case jobs::JobState::kRendering:
            return v1::JOB_STATE_RENDERING;
        case jobs::JobState::kFiltering:
            return v1::JOB_STATE_FILTERING;
        case jobs::JobState::kSucceeded:
            return v1::JOB_STATE_SUCCEEDED;
        case jobs::JobState::kFailed:
            return v1::JOB_STATE_FAILED;
        case jobs::JobState::kCancelled:
            return v1::JOB_STATE_CANCELLED;
    }
    return v1::JOB_STATE_UNSPECIFIED;
}

v1::StopReason StopToProto(jobs::StopReason reason) {
    switch (reason) {
        case jobs::StopReason::kSamples:
            return v1::STOP_REASON_SPP;
        case jobs::StopReason::kTarget:
            return v1::STOP_REASON_TARGET;
        case jobs::StopReason::kTimeLimit:
            return v1::STOP_REASON_TIME_LIMIT;
        case jobs::StopReason::kMaxSpp:
            return v1::STOP_REASON_MAX_SPP;
        case jobs::StopReason::kSampler:
            return v1::STOP_REASON_SAMPLER;
        case jobs::StopReason::kCancelled:
            return v1::STOP_REASON_CANCELLED;
    }
    return v1::STOP_REASON_UNSPECIFIED;
}

// Why it stopped, and what was and is expected of it.
void ExpectationsToProto(const jobs::JobInfo& info, v1::Job* job) {
    if (info.stop) {
        job->set_stop_reason(StopToProto(*info.stop));
    }
    if (info.image_relmse) {
        job->set_image_relmse(*info.image_relmse);
    }
    for (const auto& point : info.forecast) {
        v1::ForecastPoint* p = job->add_forecast();
        p->set_samples(point.samples);
        p->set_seconds(point.seconds);
        p->set_relmse(point.relmse);
    }
    if (info.eta) {
        job->set_eta_seconds(info.eta->seconds);
        job->set_eta_low_seconds(info.eta->low);
        job->set_eta_high_seconds(info.eta->high);
    }
    if (info.predicted) {
        job->set_predicted_seconds(info.predicted->seconds);
        job->set_predicted_low_seconds(info.predicted->low);
        job->set_predicted_high_seconds(info.predicted->high);
    }
    job->set_finish_seconds_predicted(info.finish_seconds_predicted);
    job->set_elapsed_seconds(ToSeconds(info.Used(info.updated)));
}

void OutcomeToProto(const jobs::Outcome& outcome, v1::Job* job) {
    v1::FilterSummary* filter = job->mutable_filter();
    filter->set_filter(outcome.filter);
    filter->set_seconds(outcome.seconds);
    const auto put = [](const jobs::EstimatedError& error, v1::EstimatedError* to) {
        to->set_relmse(error.relmse);
        to->set_low(error.low);
        to->set_high(error.high);
    };
    put(outcome.noisy, filter->mutable_noisy());
    if (outcome.filtered) {
        put(*outcome.filtered, filter->mutable_filtered());
    }
    if (outcome.mse) {
        filter->set_mse(*outcome.mse);
    }
    filter->mutable_notes()->insert(outcome.notes.begin(), outcome.notes.end());
    for (const jobs::FilterCandidate& from : outcome.candidates) {
        v1::FilterCandidate* to = filter->add_candidates();
        to->set_filter(from.filter);
        to->set_relmse(from.relmse);
        to->set_above_best(from.above_best);
        to->set_uncertainty(from.uncertainty);
        to->set_seconds(from.seconds);
    }
    filter->set_reason(outcome.reason);
    filter->set_dropped(outcome.dropped);
    job->set_image_sha256(outcome.image_sha256);
    job->set_result_size(outcome.result_size);
}

}  // namespace

void InfoToProto(const jobs::JobInfo& info, const WallClock& wall, v1::Job* job) {
    job->set_name(info.name);
    job->set_state(StateToProto(info.state));
    job->set_message(info.message);
    job->set_samples_done(info.samples_done);
    job->set_samples_budget(info.samples_budget.value_or(0));
    job->set_relmse(info.relmse);
    job->set_rays(info.rays);
    job->set_bad_samples(info.bad_samples);
    for (const auto& pass : info.passes) {
        v1::PassSummary* p = job->add_passes();
        p->set_index(pass.index);
        p->set_samples(pass.samples);
        p->set_active_pixels(pass.active_pixels);
        p->set_relmse(pass.relmse);
        p->set_seconds(pass.seconds);
        p->set_plan_seconds(pass.plan_seconds);
        if (pass.image_relmse) {
            p->set_image_relmse(*pass.image_relmse);
        }
        if (pass.relmse_predicted) {
            p->set_relmse_predicted(*pass.relmse_predicted);
        }
        p->set_ranges(pass.ranges);
    }
    for (const auto& [name, share] : info.workers) {
        v1::WorkerShare* w = job->add_workers();
        w->set_worker(name);
        w->set_samples(share.samples);
        w->set_leases(share.leases);
        w->set_busy_seconds(share.busy_seconds);
    }
    job->set_leases_issued(info.leases_issued);
    job->set_leases_reissued(info.leases_reissued);
    job->set_results_duplicate(info.results_duplicate);
    SetTime(wall.At(info.created - info.down), job->mutable_create_time());
    if (info.ended) {
        SetTime(wall.At(*info.ended), job->mutable_end_time());
    }
    job->set_render_seconds(info.render_seconds);
    job->set_plan_seconds(info.plan_seconds);
    job->set_plan_filter_seconds(info.plan_filter_seconds);
    job->set_merge_seconds(info.merge_seconds);
    job->mutable_notes()->Assign(info.notes.begin(), info.notes.end());
    ExpectationsToProto(info, job);
    job->set_held(info.held);
    job->set_paused(info.paused.has_value());
    job->set_restarts(info.restarts);
    job->set_save_seconds(info.save_seconds);
    if (info.audit) {
        v1::LedgerAudit* audit = job->mutable_ledger();
        audit->set_ranges(info.audit->ranges);
        audit->set_samples(info.audit->samples);
        audit->set_film_samples(info.audit->film_samples);
        audit->set_problem(info.audit->problem);
    }
    if (info.outcome) {
        OutcomeToProto(*info.outcome, job);
    }
}

std::string NumericClassText(const v1::NumericClass& numeric_class) {
    return numeric_class.build() + "/" + numeric_class.isa();
}

void WorkerToProto(const jobs::WorkerInfo& info, const WallClock& wall, v1::Worker* worker) {
    worker->set_name(info.name);
    if (!info.quarantined.empty()) {
        worker->set_quarantined(info.quarantined);
        SetTime(wall.At(info.quarantined_since), worker->mutable_quarantine_time());
    }
    if (info.away) {
        worker->set_away(true);
        return;
    }
    const std::size_t slash = info.numeric_class.rfind('/');
    worker->mutable_numeric_class()->set_build(info.numeric_class.substr(0, slash));
    worker->mutable_numeric_class()->set_isa(info.numeric_class.substr(slash + 1));
    worker->set_threads(info.threads);
    worker->set_leases_held(static_cast<std::uint32_t>(info.leases_held));
    worker->set_samples_done(info.samples_done);
    worker->set_samples_per_second(info.samples_per_second);
    worker->set_seconds_since_report(info.seconds_since_report);
}

}  // namespace relume::server
