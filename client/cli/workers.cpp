// relume workers: who renders for the server.
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/job_result.h"
#include "client/cli/options.h"
#include "client/cli/progress.h"
#include "client/cli/table.h"
#include "client/lib/client.h"

namespace relume::client {
namespace {

using Json = nlohmann::ordered_json;

struct WorkersOptions {
    ServerOptions server;
    TalkOptions talk;
};

int RunWorkers(const WorkersOptions& options) {
    Client client(RequireServer(options.server));
    const auto workers = client.Workers();
    if (options.talk.json) {
        auto json = Json::array();
        for (const auto& worker : workers) {
            json.push_back({{"name", worker.name()},
                            {"build", worker.numeric_class().build()},
                            {"isa", worker.numeric_class().isa()},
                            {"threads", worker.threads()},
                            {"leases", worker.leases_held()},
                            {"samples", worker.samples_done()},
                            {"samples_per_second", worker.samples_per_second()},
                            {"seconds_since_report", worker.seconds_since_report()},
                            {"away", worker.away()},
                            {"quarantined", worker.quarantined()},
                            {"quarantined_since", worker.has_quarantine_time()
                                                      ? Json(FormatTime(worker.quarantine_time()))
                                                      : Json(nullptr)}});
        }
        fmt::print("{}\n", json.dump(2));
        return kExitDone;
    }
    std::vector<std::vector<std::string>> rows{
        {"WORKER", "BUILD", "ISA", "THREADS", "LEASES", "SAMPLES", "SAMPLES/S", "LAST REPORT"}};
    for (const auto& worker : workers) {
        if (worker.away()) {
            rows.push_back({worker.name(), "-", "-", "-", "-", "-", "-", "away"});
            continue;
        }
        rows.push_back({worker.name(), worker.numeric_class().build(), worker.numeric_class().isa(),
                        std::to_string(worker.threads()), std::to_string(worker.leases_held()),
                        FormatCount(static_cast<double>(worker.samples_done())),
                        FormatCount(worker.samples_per_second()),
                        fmt::format("{:.1f} s ago", worker.seconds_since_report())});
    }
    fmt::print("{}", FormatTable(rows));
    for (const auto& worker : workers) {
        if (!worker.quarantined().empty()) {
            fmt::print("{}: in quarantine since {}: {}\n", worker.name(),
                       FormatTime(worker.quarantine_time()), worker.quarantined());
        }
    }
    return kExitDone;
}

}  // namespace

Runner AddWorkers(CLI::App* app) {
    const auto options = std::make_shared<WorkersOptions>();
    AddServerOption(app, &options->server);
    AddJsonOption(app, &options->talk);
    return [options](Interrupts*) { return RunWorkers(*options); };
}

}  // namespace relume::client
