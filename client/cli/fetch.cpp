// relume fetch: the image of a job that has one.
#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/job_result.h"
#include "client/cli/options.h"
#include "client/lib/client.h"
#include "proto/codec/codec.h"

namespace relume::client {
namespace {

struct FetchOptions {
    std::string job;
    ServerOptions server;
    OutputOptions output;
};

double SecondsBetween(const google::protobuf::Timestamp& start,
                      const google::protobuf::Timestamp& end) {
    return static_cast<double>(end.seconds() - start.seconds()) +
           1e-9 * static_cast<double>(end.nanos() - start.nanos());
}

int RunFetch(const FetchOptions& options, Interrupts* interrupts) {
    Client client(RequireServer(options.server));
    const Interrupts::Guard guard(interrupts, [&] { client.Interrupt(); });
    CheckOutputs(options.output);
    const v1::Job job = client.Get(options.job);
    RequireImage(job);
    ReportFacts facts;
    facts.scene = codec::FromProto(job.spec().scene());
    facts.job = facts.total = SecondsBetween(job.create_time(), job.end_time());
    SaveResult(&client, job, options.output, &facts);
    fmt::print("{}: image digest {}\n", options.output.image, job.image_sha256());
    return kExitDone;
}

}  // namespace

Runner AddFetch(CLI::App* app) {
    const auto options = std::make_shared<FetchOptions>();
    app->add_option("JOB", options->job, "its name, as `relume submit` printed it")
        ->required()
        ->type_name("NAME");
    AddOutputOptions(app, &options->output);
    AddServerOption(app, &options->server);
    return [options](Interrupts* interrupts) { return RunFetch(*options, interrupts); };
}

}  // namespace relume::client
