// relume render: from a scene to an image in one go, on a local farm or on a server.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <utility>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/job_result.h"
#include "client/cli/options.h"
#include "client/cli/prepare_job.h"
#include "client/cli/progress_meter.h"
#include "client/lib/client.h"
#include "client/lib/local_farm.h"

namespace relume::client {
namespace {

struct RenderOptions {
    JobOptions job;
    OutputOptions output;
    TalkOptions talk;
    FarmOptions farm;
    std::string server;  // "": a local farm
};

// Seconds since the last call.
class Lap {
  public:
    double operator()() {
        const auto now = std::chrono::steady_clock::now();
        return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
    }

    // Since the first.
    double Seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - first_).count();
    }

  private:
    const std::chrono::steady_clock::time_point first_ = std::chrono::steady_clock::now();
    std::chrono::steady_clock::time_point last_ = first_;
};

// Seconds from the job's end to the command's: fetching, checking and writing, making the view,
// ending the farm.
double SaveSeconds(const v1::JobSpec& spec, bool png, bool local) {
    constexpr double kAlways = 0.1, kFarm = 0.2, kFetchMegapixel = 0.15, kViewMegapixel = 0.8;
    const double megapixels = 1e-6 * PixelsOf(spec);
    return kAlways + (local ? kFarm : 0) +
           megapixels * (kFetchMegapixel + (png ? kViewMegapixel : 0));
}

// The limit of the command becomes one of the job, which is made when `elapsed` seconds are over.
v1::JobSpec WithTimeLeft(v1::JobSpec spec, const RenderOptions& options, double elapsed) {
    constexpr double kLeast = 1e-3;  // too late: the job says so
    if (spec.has_time_limit()) {
        spec.set_time_limit(std::max(
            kLeast, spec.time_limit() - elapsed -
                        SaveSeconds(spec, !options.output.png.empty(), options.server.empty())));
    }
    return spec;
}

// Says why a job that runs for this command alone was given up, and has it cancelled.
[[noreturn]] void GiveUp(Client* client, const std::string& job, bool local) {
    std::string outcome = "nothing was written";
    if (!local && !job.empty()) {
        client->Resume();
        try {
            client->Cancel(job);
            outcome += "; " + job + " was cancelled";
        } catch (const Error& error) {
            outcome += fmt::format("; {} could not be cancelled: {}", job, error.what());
        }
    }
    throw Error(ErrorCode::kCancelled, "interrupted; " + outcome);
}

void PrintResult(const RenderOptions& options, const v1::Job& job) {
    if (options.talk.json) {
        auto json = JobJson(job);
        json["image"] = options.output.image;
        json["png"] = options.output.png.empty() ? nlohmann::ordered_json(nullptr)
                                                 : nlohmann::ordered_json(options.output.png);
        json["report"] = options.output.report.empty()
                             ? nlohmann::ordered_json(nullptr)
                             : nlohmann::ordered_json(options.output.report);
        fmt::print("{}\n", json.dump(2));
        return;
    }
    fmt::print("{}\n{}: image digest {}\n", DescribeJob(job), options.output.image,
               job.image_sha256());
}

int RunRender(const RenderOptions& options, Interrupts* interrupts) {
    ProgressMeter meter(ChooseProgressStyle(options.talk.quiet, stderr), stderr);
    ReportFacts facts;
    Lap lap;
    {
        const Interrupts::Guard whole(interrupts);  // leaves no probe behind
        CheckOutputs(options.output);
    }
    interrupts->Check();
    const PreparedJob prepared = PrepareJob(options.job);
    facts.scene = prepared.scene.manifest;
    facts.notes = prepared.notes;
    facts.time_limit = options.job.budgets.time_limit;
    for (const auto& note : prepared.notes) {
        meter.Note("note: " + note);
    }
    facts.check = lap();

    const bool local = options.server.empty();
    std::unique_ptr<Client> client;  // outlives the farm, whose monitor interrupts it
    std::optional<LocalFarm> farm;
    std::string job_name;
    const Interrupts::Guard starting(interrupts);
    try {
        if (local) {
            WithExitCode(kExitServer, [&] { farm.emplace(options.farm); });
        }
        facts.start = lap();
        client = std::make_unique<Client>(local ? farm->address() : options.server);
        if (local) {
            farm->Monitor([&](const std::string& words) { meter.Warn("relume: " + words); },
                          [&](const std::string&) { client->Interrupt(); });
        }
        const Interrupts::Guard running(interrupts, [&] { client->Interrupt(); });

        client->Validate(prepared.spec);
        client->UploadScene(prepared.scene, [&](std::uint64_t done, std::uint64_t due) {
            meter.Upload(done, due);
        });
        facts.upload = lap();
        job_name = client->Create(WithTimeLeft(prepared.spec, options, lap.Seconds())).name();
        const v1::Job last =
            client->Watch(job_name, [&](const v1::Job& job) { meter.Update(job); });
        meter.Clear();
        RequireSuccess(last);
        const v1::Job job = client->Get(job_name);
        facts.job = lap();
        facts.total = facts.check + facts.start + facts.upload + facts.job;
        SaveResult(client.get(), job, options.output, &facts);
        for (const auto& note : job.notes()) {
            if (std::find(facts.notes.begin(), facts.notes.end(), note) == facts.notes.end()) {
                meter.Note("note: " + note);
            }
        }
        PrintResult(options, job);
    } catch (const Error& error) {
        meter.Clear();
        if (interrupts->signal() != 0) {
            GiveUp(client.get(), job_name, local);
        }
        if (farm && farm->failure()) {
            throw CommandError(kExitServer, *farm->failure() + "; nothing was written");
        }
        throw;
    }
    return kExitDone;
}

}  // namespace

Runner AddRender(CLI::App* app) {
    const auto options = std::make_shared<RenderOptions>();
    AddJobOptions(app, &options->job);
    AddOutputOptions(app, &options->output);
    auto* workers = app->add_option("--workers", options->farm.workers,
                                    "worker processes of the local farm, 1 to 256 [1]")
                        ->check(Between(1, 256))
                        ->type_name("N");
    auto* threads = app->add_option("--threads", options->farm.threads,
                                    "threads of each of them, 1 to 1024 [the cores shared out]")
                        ->check(Between(1, 1024))
                        ->type_name("N");
    AddServerOption(app, &options->server);
    AddQuietOption(app, &options->talk);
    AddJsonOption(app, &options->talk);
    app->footer(
        "Without --server (or RELUME_SERVER) a farm is started on this machine and ends "
        "with the command.\n--workers and --threads ask for one, whatever RELUME_SERVER "
        "says.");
    return [=](Interrupts* interrupts) {
        const bool farm = workers->count() + threads->count() > 0;
        if (farm && !options->server.empty()) {
            ThrowInvalidArgument(
                "--workers and --threads are for a local farm; leave them out with --server");
        }
        options->server = farm ? "" : FindServer(options->server);
        return RunRender(*options, interrupts);
    };
}

}  // namespace relume::client
