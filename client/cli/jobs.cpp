// relume jobs: what the server has to do and has done.
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/job_result.h"
#include "client/cli/options.h"
#include "client/cli/progress.h"
#include "client/cli/table.h"
#include "client/lib/client.h"
#include "client/lib/job_names.h"

namespace relume::client {
namespace {

struct JobsOptions {
    ServerOptions server;
    int limit = 50;
    TalkOptions talk;
};

int RunJobs(const JobsOptions& options) {
    Client client(RequireServer(options.server));
    const auto jobs = client.List(static_cast<std::size_t>(options.limit));
    if (options.talk.json) {
        auto json = nlohmann::ordered_json::array();
        for (const auto& job : jobs) {
            json.push_back(JobJson(job));
        }
        fmt::print("{}\n", json.dump(2));
        return kExitDone;
    }
    std::vector<std::vector<std::string>> rows{{"JOB", "STATE", "PRIORITY", "OWNER", "SHARE",
                                                "DONE", "SIZE", "SPP", "CREATED", "SCENE", "NAME"}};
    for (const auto& job : jobs) {
        const auto share = job.state() == v1::JOB_STATE_SUCCEEDED ? 1 : ShareDone(job);
        const auto& settings = job.spec().settings();
        rows.push_back({job.name(), StateText(job) + (job.held().empty() ? "" : " (held)"),
                        std::to_string(job.spec().priority()), job.spec().owner(),
                        job.has_share() ? fmt::format("{:.0f}%", 100 * job.share()) : "-",
                        share ? fmt::format("{:.0f}%", 100 * *share) : "-",
                        fmt::format("{}x{}", settings.width(), settings.height()),
                        fmt::format("{:.2f}", MeanSpp(job)), FormatTime(job.create_time()),
                        job.spec().scene().main(), job.spec().display_name()});
    }
    fmt::print("{}", FormatTable(rows));
    return kExitDone;
}

}  // namespace

Runner AddJobs(CLI::App* app) {
    const auto options = std::make_shared<JobsOptions>();
    app->add_option("--limit", options->limit, "so many, the newest first [50]")
        ->check(Between(1, 1'000'000))
        ->type_name("N");
    AddServerOption(app, &options->server);
    AddJsonOption(app, &options->talk);
    return [options](Interrupts*) { return RunJobs(*options); };
}

}  // namespace relume::client
