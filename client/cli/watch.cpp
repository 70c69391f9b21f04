// relume watch: shows a job until it is over. Watching changes nothing: whoever stops it does not
// stop the job.
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/job_result.h"
#include "client/cli/options.h"
#include "client/cli/progress_meter.h"
#include "client/cli/watch_frames.h"
#include "client/lib/client.h"
#include "client/lib/job_group.h"
#include "client/lib/job_names.h"

namespace relume::client {
namespace {

struct WatchOptions {
    std::vector<std::string> jobs;
    ServerOptions server;
    TalkOptions talk;
};

int RunWatch(const WatchOptions& options, Interrupts* interrupts) {
    Client client(RequireServer(options.server));
    const std::string& name = options.jobs.front();
    if (options.jobs.size() > 1 || IsGroupName(name)) {
        return WatchJobs(&client, options.jobs, options.talk, interrupts);
    }
    ProgressMeter meter(ChooseProgressStyle(options.talk.quiet, stderr), stderr);
    v1::Job job;
    try {
        const Interrupts::Guard guard(interrupts, [&] { client.Interrupt(); });
        client.Watch(name, [&](const v1::Job& event) { meter.Update(event); });
        job = client.Get(name);
    } catch (const Error&) {
        meter.Clear();
        if (interrupts->signal() == 0) {
            throw;
        }
        throw Error(ErrorCode::kCancelled,
                    fmt::format("interrupted; {0} goes on, see `relume watch {0}` or `relume "
                                "cancel {0}`",
                                JobName(name)));
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
    app->add_option("JOB", options->jobs,
                    "its name, as `relume submit` printed it; also several, or a group")
        ->required()
        ->type_name("NAME");
    AddServerOption(app, &options->server);
    AddQuietOption(app, &options->talk);
    AddJsonOption(app, &options->talk);
    return [options](Interrupts* interrupts) { return RunWatch(*options, interrupts); };
}

}  // namespace relume::client
