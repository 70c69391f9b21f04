#include "server/rpc/saved_info.h"

#include <algorithm>
#include <chrono>

#include "core/base/error.h"
#include "relume/v1/saved.pb.h"

namespace relume::server {
namespace {

std::chrono::system_clock::time_point TimeOf(const google::protobuf::Timestamp& message) {
    return std::chrono::system_clock::time_point(
        std::chrono::duration_cast<std::chrono::system_clock::duration>(
            std::chrono::seconds(message.seconds()) + std::chrono::nanoseconds(message.nanos())));
}

jobs::JobState StateOf(v1::JobState state) {
    switch (state) {
        case v1::JOB_STATE_RENDERING:
            return jobs::JobState::kRendering;
        case v1::JOB_STATE_FILTERING:
            return jobs::JobState::kFiltering;
        case v1::JOB_STATE_SUCCEEDED:
            return jobs::JobState::kSucceeded;
        case v1::JOB_STATE_FAILED:
            return jobs::JobState::kFailed;
        case v1::JOB_STATE_CANCELLED:
            return jobs::JobState::kCancelled;
        default:
            return jobs::JobState::kQueued;
    }
}

std::optional<jobs::StopReason> StopOf(v1::StopReason reason) {
    switch (reason) {
        case v1::STOP_REASON_SPP:
            return jobs::StopReason::kSamples;
        case v1::STOP_REASON_TARGET:
            return jobs::StopReason::kTarget;
        case v1::STOP_REASON_TIME_LIMIT:
            return jobs::StopReason::kTimeLimit;
        case v1::STOP_REASON_MAX_SPP:
            return jobs::StopReason::kMaxSpp;
        case v1::STOP_REASON_SAMPLER:
            return jobs::StopReason::kSampler;
        case v1::STOP_REASON_CANCELLED:
            return jobs::StopReason::kCancelled;
        default:
            return std::nullopt;
    }
}

jobs::EstimatedError ErrorOf(const v1::EstimatedError& error) {
    return {error.relmse(), error.low(), error.high()};
}

jobs::Outcome OutcomeOf(const v1::Job& job) {
    const v1::FilterSummary& filter = job.filter();
    jobs::Outcome outcome;
    outcome.filter = filter.filter();
    outcome.seconds = filter.seconds();
    if (filter.has_mse()) {
        outcome.mse = filter.mse();
    }
    outcome.noisy = ErrorOf(filter.noisy());
    if (filter.has_filtered()) {
        outcome.filtered = ErrorOf(filter.filtered());
    }
    outcome.notes.insert(filter.notes().begin(), filter.notes().end());
    for (const auto& c : filter.candidates()) {
        outcome.candidates.push_back(
            {c.filter(), c.relmse(), c.above_best(), c.uncertainty(), c.seconds()});
    }
    outcome.reason = filter.reason();
    outcome.dropped = filter.dropped();
    outcome.image_sha256 = job.image_sha256();
    outcome.result_size = job.result_size();
    return outcome;
}

void LoadPasses(const v1::Job& job, jobs::JobInfo* info) {
    for (const auto& p : job.passes()) {
        jobs::PassSummary& pass = info->passes.emplace_back();
        pass.index = p.index();
        pass.samples = p.samples();
        pass.active_pixels = p.active_pixels();
        pass.relmse = p.relmse();
        pass.seconds = p.seconds();
        pass.plan_seconds = p.plan_seconds();
        if (p.has_image_relmse()) {
            pass.image_relmse = p.image_relmse();
        }
        if (p.has_relmse_predicted()) {
            pass.relmse_predicted = p.relmse_predicted();
        }
        pass.ranges = p.ranges();
    }
}

void LoadExpectations(const v1::Job& job, jobs::JobInfo* info) {
    info->stop = StopOf(job.stop_reason());
    if (job.has_image_relmse()) {
        info->image_relmse = job.image_relmse();
    }
    for (const auto& point : job.forecast()) {
        info->forecast.push_back({point.samples(), point.seconds(), point.relmse()});
    }
    if (job.has_predicted_seconds()) {
        info->predicted = jobs::Eta{job.predicted_seconds(), job.predicted_low_seconds(),
                                    job.predicted_high_seconds()};
    }
    info->finish_seconds_predicted = job.finish_seconds_predicted();
}

}  // namespace

std::string SaveInfo(const jobs::JobInfo& info, const WallClock& wall) {
    v1::SavedInfo saved;
    InfoToProto(info, wall, saved.mutable_job());
    saved.set_number(info.number);
    saved.set_busy_seconds(info.busy_seconds);
    if (info.wait_seconds) {
        saved.set_wait_seconds(*info.wait_seconds);
    }
    saved.set_numeric_class(info.numeric_class);
    return saved.SerializeAsString();
}

jobs::JobInfo LoadInfo(std::string_view bytes, double used_seconds, const WallClock& wall,
                       TimePoint now) {
    v1::SavedInfo saved;
    if (!saved.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
        throw Error(ErrorCode::kDataLoss, "what was saved of the job can't be read");
    }
    const v1::Job& job = saved.job();
    jobs::JobInfo info;
    info.name = job.name();
    info.number = saved.number();
    info.state = StateOf(job.state());
    info.message = job.message();
    info.samples_done = job.samples_done();
    if (job.samples_budget() > 0) {
        info.samples_budget = job.samples_budget();
    }
    info.relmse = job.relmse();
    info.rays = job.rays();
    info.bad_samples = job.bad_samples();
    LoadPasses(job, &info);
    if (job.has_filter()) {
        info.outcome = OutcomeOf(job);
    }
    for (const auto& w : job.workers()) {
        info.workers[w.worker()] = {w.samples(), w.leases(), w.busy_seconds()};
    }
    info.leases_issued = job.leases_issued();
    info.leases_reissued = job.leases_reissued();
    info.results_duplicate = job.results_duplicate();
    info.busy_seconds = saved.busy_seconds();
    if (saved.has_wait_seconds()) {
        info.wait_seconds = saved.wait_seconds();
    }
    info.render_seconds = job.render_seconds();
    info.plan_seconds = job.plan_seconds();
    info.plan_filter_seconds = job.plan_filter_seconds();
    info.merge_seconds = job.merge_seconds();
    info.notes.assign(job.notes().begin(), job.notes().end());
    LoadExpectations(job, &info);
    info.numeric_class = saved.numeric_class();
    if (job.has_ledger()) {
        const v1::LedgerAudit& audit = job.ledger();
        info.audit = {audit.ranges(), audit.samples(), audit.film_samples(), audit.problem()};
    }
    info.restarts = job.restarts();
    info.save_seconds = job.save_seconds();

    const TimePoint made = wall.Of(TimeOf(job.create_time()));
    if (job.has_end_time()) {
        info.ended = wall.Of(TimeOf(job.end_time()));
        info.created = *info.ended - FromSeconds(job.elapsed_seconds());
    } else {
        info.created = now - FromSeconds(std::max(used_seconds, job.elapsed_seconds()));
    }
    if (job.paused()) {
        info.paused = now;
    }
    info.down = info.created - made;
    info.updated = now;
    return info;
}

}  // namespace relume::server
