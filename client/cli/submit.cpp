// relume submit: hands a job to a server and leaves.
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/options.h"
#include "client/cli/prepare_job.h"
#include "client/cli/progress_meter.h"
#include "client/lib/client.h"

namespace relume::client {
namespace {

struct SubmitOptions {
    JobOptions job;
    TalkOptions talk;
    ServerOptions server;
};

int RunSubmit(const SubmitOptions& options) {
    const Endpoint server = RequireServer(options.server);
    ProgressMeter meter(ChooseProgressStyle(options.talk.quiet, stderr), stderr);
    const PreparedJob prepared = PrepareJob(options.job);
    for (const auto& note : prepared.notes) {
        meter.Note("note: " + note);
    }
    Client client(server);
    client.Validate(prepared.spec);
    client.UploadScene(prepared.scene,
                       [&](std::uint64_t done, std::uint64_t due) { meter.Upload(done, due); });
    const v1::Job job = client.Create(prepared.spec);
    meter.Clear();
    if (options.talk.json) {
        fmt::print("{}\n", nlohmann::ordered_json{{"job", job.name()}}.dump());
    } else {
        fmt::print("{}\n", job.name());
    }
    return kExitDone;
}

}  // namespace

Runner AddSubmit(CLI::App* app) {
    const auto options = std::make_shared<SubmitOptions>();
    AddJobOptions(app, &options->job);
    AddServerOption(app, &options->server);
    AddQuietOption(app, &options->talk);
    AddJsonOption(app, &options->talk);
    return [options](Interrupts*) { return RunSubmit(*options); };
}

}  // namespace relume::client
