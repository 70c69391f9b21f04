// relume release: ends the quarantine of workers.
#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/options.h"
#include "client/lib/client.h"

namespace relume::client {
namespace {

struct ReleaseOptions {
    std::vector<std::string> workers;
    ServerOptions server;
};

int RunRelease(const ReleaseOptions& options) {
    Client client(RequireServer(options.server));
    for (const std::string& worker : options.workers) {
        client.Release(worker);
        fmt::print("{}: released\n", worker);
    }
    return kExitDone;
}

}  // namespace

Runner AddRelease(CLI::App* app) {
    const auto options = std::make_shared<ReleaseOptions>();
    app->add_option("WORKER", options->workers, "their names, as `relume workers` lists them")
        ->required()
        ->type_name("NAME");
    AddServerOption(app, &options->server);
    app->footer(
        "A worker is in quarantine when its answer to work was another than that of others. Find\n"
        "out why first: it may have bad memory. Where the server asks for certificates, this "
        "needs\n"
        "an operator's or an admin's.");
    return [options](Interrupts*) { return RunRelease(*options); };
}

}  // namespace relume::client
