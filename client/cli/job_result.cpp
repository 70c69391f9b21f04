#include "client/cli/job_result.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <list>

#include "client/cli/exit_codes.h"
#include "client/cli/progress.h"
#include "client/lib/job_names.h"
#include "core/image/exr.h"
#include "core/image/png_view.h"

namespace relume::client {
namespace {

// Thread time of workers in its samples.
double CoreSeconds(const v1::Job& job) {
    double seconds = 0;
    for (const auto& share : job.workers()) {
        seconds += share.busy_seconds();
    }
    return seconds;
}

}  // namespace

void RequireSuccess(const v1::Job& job) {
    if (job.state() == v1::JOB_STATE_SUCCEEDED) {
        return;
    }
    if (!IsOver(job.state())) {
        throw CommandError(kExitJob, fmt::format("{} is not over, it is {}; see `relume watch {}`",
                                                 job.name(), StateName(job.state()), job.name()));
    }
    if (job.state() == v1::JOB_STATE_FAILED) {
        throw CommandError(kExitJob, fmt::format("{} has failed: {}", job.name(), job.message()));
    }
    throw CommandError(kExitJob,
                       job.result_size() == 0
                           ? fmt::format("{} was cancelled", job.name())
                           : fmt::format("{} was cancelled at {:.2f} spp; `relume fetch {} -o "
                                         "FILE` gets the image of these",
                                         job.name(), MeanSpp(job), job.name()));
}

void RequireImage(const v1::Job& job) {
    if (job.state() != v1::JOB_STATE_CANCELLED || job.result_size() == 0) {
        RequireSuccess(job);
    }
}

void SaveResult(Client* client, const v1::Job& job, const OutputOptions& output,
                ReportFacts* facts) {
    const auto start = std::chrono::steady_clock::now();
    std::list<OutputFile> files;
    OutputFile& image = files.emplace_back(output.image);
    client->Fetch(job.name(), &image);
    if (!output.png.empty()) {
        files.emplace_back(output.png).Append(EncodePngView(ReadExr(image.temporary())));
    }
    facts->output = output.image;
    facts->fetch = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    facts->total += facts->fetch;
    if (!output.report.empty()) {
        files.emplace_back(output.report).Append(MakeReport(job, *facts).dump(2) + "\n");
    }
    for (auto& file : files) {
        file.Commit();
    }
}

std::string DescribeJob(const v1::Job& job) {
    const auto& settings = job.spec().settings();
    std::string text = fmt::format("{}: {}, {}x{}", job.name(), StateName(job.state()),
                                   settings.width(), settings.height());
    if (job.samples_done() > 0) {
        text +=
            fmt::format(", {:.2f} spp in {}", MeanSpp(job), FormatDuration(job.render_seconds()));
    }
    if (job.has_filter() && job.filter().has_filtered()) {
        const auto& error = job.filter().filtered();
        text += fmt::format(", estimated RelMSE {:.3g} ({:.3g} to {:.3g})", error.relmse(),
                            error.low(), error.high());
    } else if (const auto error = EstimatedError(job)) {
        text += fmt::format(", estimated RelMSE {:.3g}{}", *error,
                            job.spec().has_target() ? "" : " before the filter");
    }
    if (!job.message().empty()) {
        text += " (" + job.message() + ")";
    }
    return text;
}

double SecondsOf(const v1::Job& job) {
    const auto &start = job.create_time(), &end = job.end_time();
    return static_cast<double>(end.seconds() - start.seconds()) +
           1e-9 * static_cast<double>(end.nanos() - start.nanos());
}

std::string FormatTime(const google::protobuf::Timestamp& time) {
    if (time.seconds() == 0) {
        return "";
    }
    return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}",
                       fmt::gmtime(static_cast<std::time_t>(time.seconds())));
}

nlohmann::ordered_json JobJson(const v1::Job& job) {
    const auto& settings = job.spec().settings();
    return {{"job", job.name()},
            {"name", job.spec().display_name()},
            {"group", OrNull(!job.spec().group().empty(), job.spec().group())},
            {"frame", OrNull(job.spec().has_frame(), job.spec().frame())},
            {"state", StateName(job.state())},
            {"paused", job.paused()},
            {"priority", job.spec().priority()},
            {"owner", job.spec().owner()},
            {"core_seconds", CoreSeconds(job)},
            {"share", OrNull(job.has_share(), job.share())},
            {"message", job.message()},
            {"scene", job.spec().scene().main()},
            {"width", settings.width()},
            {"height", settings.height()},
            {"samples", job.samples_done()},
            {"budget", OrNull(job.samples_budget() > 0, job.samples_budget())},
            {"spp", MeanSpp(job)},
            {"relmse", job.relmse()},
            {"image_relmse", OrNull(job.has_image_relmse(), job.image_relmse())},
            {"stop_reason", StopReasonName(job.stop_reason())},
            {"eta_seconds", OrNull(job.has_eta_seconds(), job.eta_seconds())},
            {"eta_low_seconds", OrNull(job.has_eta_seconds(), job.eta_low_seconds())},
            {"eta_high_seconds", OrNull(job.has_eta_seconds(), job.eta_high_seconds())},
            {"render_seconds", job.render_seconds()},
            {"sampler", job.spec().sampler()},
            {"filter", job.spec().filter()},
            {"created", FormatTime(job.create_time())},
            {"ended", FormatTime(job.end_time())},
            {"held", OrNull(!job.held().empty(), job.held())},
            {"restarts", job.restarts()},
            {"save_seconds", job.save_seconds()},
            {"ledger", LedgerJson(job)},
            {"image_sha256", job.image_sha256()},
            {"image_bytes", job.result_size()}};
}

}  // namespace relume::client
