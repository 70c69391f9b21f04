// relume update: changes the priority of jobs that are not over.
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

struct UpdateOptions {
    std::vector<std::string> jobs;
    int priority = 0;
    ServerOptions server;
};

int RunUpdate(const UpdateOptions& options) {
    Client client(RequireServer(options.server));
    for (const auto& found : FindJobsToChange(&client, options.jobs)) {
        const v1::Job job = client.SetPriority(found.name(), options.priority);
        fmt::print("{}: {}, priority {}\n", job.name(), StateText(job), job.spec().priority());
    }
    return kExitDone;
}

}  // namespace

Runner AddUpdate(CLI::App* app) {
    const auto options = std::make_shared<UpdateOptions>();
    app->add_option("JOB", options->jobs, "their names, or those of groups")
        ->required()
        ->type_name("NAME");
    AddPriorityOption(app, &options->priority)->required();
    AddServerOption(app, &options->server);
    return [options](Interrupts*) { return RunUpdate(*options); };
}

}  // namespace relume::client
