// relume extend: adds samples to a job that has an image.
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/options.h"
#include "client/lib/client.h"
#include "client/lib/job_names.h"
#include "proto/codec/budgets.h"

namespace relume::client {
namespace {

struct ExtendOptions {
    std::string job;
    double spp = 0;
    ServerOptions server;
};

int RunExtend(const ExtendOptions& options) {
    Client client(RequireServer(options.server));
    const v1::Job job = client.Extend(options.job, options.spp);
    fmt::print("{}: {}\n", job.name(), StateName(job.state()));
    return kExitDone;
}

}  // namespace

Runner AddExtend(CLI::App* app) {
    const auto options = std::make_shared<ExtendOptions>();
    app->add_option("JOB", options->job, "its name, as `relume submit` printed it")
        ->required()
        ->type_name("NAME");
    app->add_option("--spp", options->spp,
                    "mean samples a pixel that it is to have in the end; its target and time "
                    "limit go")
        ->required()
        ->check(CLI::Range(0.0, static_cast<double>(codec::kMaxSpp)))
        ->type_name("N");
    AddServerOption(app, &options->server);
    app->footer(
        "The samples that it has stay, and its sampler goes on from them. `relume watch` it, and\n"
        "`relume fetch` the new image.");
    return [options](Interrupts*) { return RunExtend(*options); };
}

}  // namespace relume::client
