// relume watch: shows a job until it is over. Watching changes nothing: whoever stops it does not
// stop the job.
#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/job_result.h"
#include "client/cli/options.h"
#include "client/cli/progress_meter.h"
#include "client/lib/client.h"
#include "client/lib/job_names.h"

namespace relume::client {
namespace {

struct WatchOptions {
    std::string job;
    ServerOptions server;
    TalkOptions talk;
};

int RunWatch(const WatchOptions& options, Interrupts* interrupts) {
    ProgressMeter meter(ChooseProgressStyle(options.talk.quiet, stderr), stderr);
    Client client(RequireServer(options.server));
    v1::Job job;
    try {
        const Interrupts::Guard guard(interrupts, [&] { client.Interrupt(); });
        client.Watch(options.job, [&](const v1::Job& event) { meter.Update(event); });
        job = client.Get(options.job);
    } catch (const Error&) {
        meter.Clear();
        if (interrupts->signal() == 0) {
            throw;
        }
        throw Error(ErrorCode::kCancelled,
                    fmt::format("interrupted; {0} goes on, see `relume watch {0}` or `relume "
                                "cancel {0}`",
                                JobName(options.job)));
    }
    meter.Clear();
    if (options.talk.json) {
        fmt::print("{}\n", JobJson(job).dump(2));
    }
    RequireSuccess(job);
    if (!options.talk.json && !options.talk.quiet) {
        fmt::print("{}\n", DescribeJob(job));
    }
    return kExitDone;
}

}  // namespace

Runner AddWatch(CLI::App* app) {
    const auto options = std::make_shared<WatchOptions>();
    app->add_option("JOB", options->job, "its name, as `relume submit` printed it")
        ->required()
        ->type_name("NAME");
    AddServerOption(app, &options->server);
    AddQuietOption(app, &options->talk);
    AddJsonOption(app, &options->talk);
    return [options](Interrupts* interrupts) { return RunWatch(*options, interrupts); };
}

}  // namespace relume::client
