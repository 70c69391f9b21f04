// relume fetch: the image of a job that has one.
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/fetch_frames.h"
#include "client/cli/job_result.h"
#include "client/cli/options.h"
#include "client/lib/client.h"
#include "client/lib/job_group.h"
#include "proto/codec/codec.h"

namespace relume::client {
namespace {

struct FetchOptions {
    std::vector<std::string> jobs;
    bool skip_existing = false;
    ServerOptions server;
    OutputOptions output;
};

int RunFetch(const FetchOptions& options, Interrupts* interrupts) {
    Client client(RequireServer(options.server));
    const Interrupts::Guard guard(interrupts, [&] { client.Interrupt(); });
    if (options.jobs.size() > 1 || IsGroupName(options.jobs.front()) || options.skip_existing) {
        return FetchFrames(&client, options.jobs, options.output, options.skip_existing);
    }
    CheckOutputs(options.output);
    const v1::Job job = client.Get(options.jobs.front());
    RequireImage(job);
    ReportFacts facts;
    facts.scene = codec::FromProto(job.spec().scene());
    facts.job = facts.total = SecondsOf(job);
    SaveResult(&client, job, options.output, &facts);
    fmt::print("{}: image digest {}\n", options.output.image, job.image_sha256());
    return kExitDone;
}

}  // namespace

Runner AddFetch(CLI::App* app) {
    const auto options = std::make_shared<FetchOptions>();
    app->add_option("JOB", options->jobs,
                    "its name, as `relume submit` printed it; or frames, or a group of them, whose "
                    "files have names like out.####.exr")
        ->required()
        ->type_name("NAME");
    app->add_flag("--skip-existing", options->skip_existing,
                  "of frames: leave out those whose files are there");
    AddOutputOptions(app, &options->output);
    AddServerOption(app, &options->server);
    return [options](Interrupts* interrupts) { return RunFetch(*options, interrupts); };
}

}  // namespace relume::client
