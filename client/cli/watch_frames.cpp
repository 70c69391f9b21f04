#include "client/cli/watch_frames.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>

#include "client/cli/exit_codes.h"
#include "client/cli/job_result.h"
#include "client/cli/progress_meter.h"
#include "client/lib/job_group.h"
#include "client/lib/job_names.h"
#include "core/base/error.h"

namespace relume::client {
namespace {

constexpr std::size_t kReasonsTold = 3;

std::string Prefix(const v1::Job& job, std::size_t over, std::size_t count) {
    const std::string what =
        job.spec().has_frame() ? fmt::format("frame {}", job.spec().frame()) : job.name();
    return fmt::format("{}, {} of {} over: ", what, over, count);
}

}  // namespace

int WatchJobs(Client* client, const std::vector<std::string>& names, const TalkOptions& talk,
              Interrupts* interrupts) {
    ProgressMeter meter(ChooseProgressStyle(talk.quiet, stderr), stderr);
    auto json = nlohmann::ordered_json::array();
    std::vector<std::string> problems;
    std::size_t over = 0, count = 0;
    try {
        const Interrupts::Guard guard(interrupts, [&] { client->Interrupt(); });
        const std::vector<v1::Job> jobs = FindJobs(client, names);
        count = jobs.size();
        for (const v1::Job& listed : jobs) {
            v1::Job job = listed;
            meter.Announce(Prefix(job, over, count));
            if (!IsOver(job.state())) {
                client->Watch(job.name(), [&](const v1::Job& event) { meter.Update(event); });
                job = client->Get(job.name());
            }
            ++over;
            meter.Clear();
            if (talk.json) {
                json.push_back(JobJson(job));
            } else if (!talk.quiet) {
                fmt::print("{}\n", DescribeJob(job));
                std::fflush(stdout);
            }
            try {
                RequireSuccess(job);
            } catch (const CommandError& error) {
                problems.emplace_back(error.what());
            }
        }
    } catch (const Error&) {
        meter.Clear();
        if (interrupts->signal() == 0) {
            throw;
        }
        throw Error(ErrorCode::kCancelled,
                    fmt::format("interrupted; the jobs go on, see `relume watch {0}` or `relume "
                                "cancel {0}`",
                                fmt::join(names, " ")));
    }
    if (talk.json) {
        fmt::print("{}\n", json.dump(2));
    }
    if (!problems.empty()) {
        const std::size_t bad = problems.size();
        problems.resize(std::min(bad, kReasonsTold));
        throw CommandError(
            kExitJob, fmt::format("{} of {} jobs have not succeeded: {}{}", bad, count,
                                  fmt::join(problems, "; "), bad > kReasonsTold ? "; ..." : ""));
    }
    return kExitDone;
}

}  // namespace relume::client
