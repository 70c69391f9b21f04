// relume pause: holds jobs until `relume resume`.
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/options.h"
#include "client/lib/client.h"
#include "client/lib/job_group.h"
#include "client/lib/job_names.h"

namespace relume::client {
namespace {

struct PauseOptions {
    std::vector<std::string> jobs;
    ServerOptions server;
};

int RunPause(const PauseOptions& options) {
    Client client(RequireServer(options.server));
    for (const auto& found : FindJobsToChange(&client, options.jobs)) {
        const v1::Job job = client.Pause(found.name());
        fmt::print("{}: {}\n", job.name(), StateText(job));
    }
    return kExitDone;
}

}  // namespace

Runner AddPause(CLI::App* app) {
    const auto options = std::make_shared<PauseOptions>();
    app->add_option("JOB", options->jobs, "their names, or those of groups")
        ->required()
        ->type_name("NAME");
    AddServerOption(app, &options->server);
    app->footer(
        "What workers have in hand is still taken, and nothing is lost; the job's time limit\n"
        "stands still. A restart of the server changes nothing of it.");
    return [options](Interrupts*) { return RunPause(*options); };
}

}  // namespace relume::client
