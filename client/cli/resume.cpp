// relume resume: lets paused jobs go on.
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

struct ResumeOptions {
    std::vector<std::string> jobs;
    ServerOptions server;
};

int RunResume(const ResumeOptions& options) {
    Client client(RequireServer(options.server));
    for (const auto& found : FindJobsToChange(&client, options.jobs)) {
        const v1::Job job = client.Continue(found.name());
        fmt::print("{}: {}\n", job.name(), StateText(job));
    }
    return kExitDone;
}

}  // namespace

Runner AddResume(CLI::App* app) {
    const auto options = std::make_shared<ResumeOptions>();
    app->add_option("JOB", options->jobs,
                    "their names, or those of groups; a job that is not paused stays as it is")
        ->required()
        ->type_name("NAME");
    AddServerOption(app, &options->server);
    app->footer("The image is the same as without the pause, bit for bit.");
    return [options](Interrupts*) { return RunResume(*options); };
}

}  // namespace relume::client
