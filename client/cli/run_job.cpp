#include "client/cli/run_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include "client/cli/exit_codes.h"
#include "client/cli/job_result.h"
#include "client/cli/options.h"
#include "core/base/error.h"

namespace relume::client {
namespace {

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

// The limit of the command becomes one of the job, which is made now that `elapsed` seconds are
// over.
v1::JobSpec WithTimeLeft(v1::JobSpec spec, double elapsed, double save_seconds) {
    constexpr double kLeast = 1e-3;  // too late: the job says so
    if (spec.has_time_limit()) {
        spec.set_time_limit(std::max(kLeast, spec.time_limit() - elapsed - save_seconds));
    }
    return spec;
}

// Says why the work was given up, and has its jobs cancelled.
[[noreturn]] void GiveUp(Client* client, const Undertaking& undertaking, bool local) {
    std::string outcome = undertaking.outcome;
    if (!local && client != nullptr) {
        client->Resume();
        for (const std::string& job : undertaking.jobs) {
            try {
                client->Cancel(job, true);
                outcome += "; " + job + " was cancelled";
            } catch (const Error& error) {
                outcome += fmt::format("; {} could not be cancelled: {}", job, error.what());
            }
        }
    }
    throw Error(ErrorCode::kCancelled, "interrupted; " + outcome);
}

}  // namespace

std::function<void()> AddPlaceOptions(CLI::App* app, PlaceOptions* options) {
    auto* workers = app->add_option("--workers", options->farm.workers,
                                    "worker processes of the local farm, 1 to 256 [1]")
                        ->check(Between(1, 256))
                        ->type_name("N");
    auto* threads = app->add_option("--threads", options->farm.threads,
                                    "threads of each of them, 1 to 1024 [the cores shared out]")
                        ->check(Between(1, 1024))
                        ->type_name("N");
    AddServerOption(app, &options->given);
    app->footer(
        "Without --server (or RELUME_SERVER) a farm is started on this machine and ends "
        "with the command.\n--workers and --threads ask for one, whatever RELUME_SERVER "
        "says.");
    return [=] {
        const bool farm = workers->count() + threads->count() > 0;
        if (farm && !options->given.address.empty()) {
            ThrowInvalidArgument(
                "--workers and --threads are for a local farm; leave them out with --server");
        }
        options->server = farm ? Endpoint() : FindServer(options->given);
    };
}

void WorkAt(const PlaceOptions& place, Interrupts* interrupts, ProgressMeter* meter,
            Undertaking* undertaking, const std::function<void(Client*)>& work) {
    const bool local = place.server.address.empty();
    std::unique_ptr<Client> client;  // outlives the farm, whose monitor interrupts it
    std::optional<LocalFarm> farm;
    const Interrupts::Guard starting(interrupts);
    try {
        if (local) {
            WithExitCode(kExitServer, [&] { farm.emplace(place.farm); });
        }
        client = std::make_unique<Client>(local ? Endpoint{farm->address(), {}} : place.server);
        if (local) {
            farm->Monitor([&](const std::string& words) { meter->Warn("relume: " + words); },
                          [&](const std::string&) { client->Interrupt(); });
        }
        const Interrupts::Guard running(interrupts, [&] { client->Interrupt(); });
        work(client.get());
    } catch (const Error& error) {
        meter->Clear();
        if (interrupts->signal() != 0) {
            GiveUp(client.get(), *undertaking, local);
        }
        if (farm && farm->failure()) {
            throw CommandError(kExitServer, *farm->failure() + "; " + undertaking->outcome);
        }
        throw;
    }
}

void RunJob(const PreparedJob& prepared, const PlaceOptions& place, Interrupts* interrupts,
            ProgressMeter* meter, ReportFacts* facts, double save_seconds,
            const std::function<void(const v1::Job&)>& show,
            const std::function<void(Client*, const v1::Job&)>& finish) {
    Lap lap;
    Undertaking undertaking;
    WorkAt(place, interrupts, meter, &undertaking, [&](Client* client) {
        facts->start = lap();
        client->Validate(prepared.spec);
        client->UploadScene(prepared.scene, [&](std::uint64_t done, std::uint64_t due) {
            meter->Upload(done, due);
        });
        facts->upload = lap();
        const std::string job_name =
            client->Create(WithTimeLeft(prepared.spec, facts->check + lap.Seconds(), save_seconds))
                .name();
        undertaking.jobs = {job_name};
        const v1::Job last = client->Watch(job_name, show);
        meter->Clear();
        RequireSuccess(last);
        const v1::Job job = client->Get(job_name);
        facts->job = lap();
        facts->total = facts->check + facts->start + facts->upload + facts->job;
        finish(client, job);
    });
}

}  // namespace relume::client
