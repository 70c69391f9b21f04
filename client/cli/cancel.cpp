// relume cancel: ends jobs that are not over, with an image of what is there.
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

struct CancelOptions {
    std::vector<std::string> jobs;
    bool discard = false;
    ServerOptions server;
};

int RunCancel(const CancelOptions& options) {
    Client client(RequireServer(options.server));
    for (const auto& found : FindJobs(&client, options.jobs)) {
        const v1::Job job = client.Cancel(found.name(), options.discard);
        fmt::print("{}: {}\n", job.name(), StateText(job));
    }
    return kExitDone;
}

}  // namespace

Runner AddCancel(CLI::App* app) {
    const auto options = std::make_shared<CancelOptions>();
    app->add_option("JOB", options->jobs,
                    "their names, or those of groups; a job that is over stays as it is")
        ->required()
        ->type_name("NAME");
    app->add_flag("--discard", options->discard, "at once, and without an image");
    AddServerOption(app, &options->server);
    app->footer(
        "The samples that are there are filtered and become the image: `relume watch` tells when\n"
        "it is there, `relume fetch` gets it, `relume extend` takes the job up again.");
    return [options](Interrupts*) { return RunCancel(*options); };
}

}  // namespace relume::client
