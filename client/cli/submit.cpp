// relume submit: hands a job to a server and leaves.
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/frame_options.h"
#include "client/cli/options.h"
#include "client/cli/prepare_job.h"
#include "client/cli/progress_meter.h"
#include "client/lib/client.h"
#include "client/lib/job_group.h"
#include "core/base/error.h"

namespace relume::client {
namespace {

struct SubmitOptions {
    JobOptions job;
    FrameOptions frames;
    TalkOptions talk;
    ServerOptions server;
};

// Cancels what a submission that is broken off has made, and says so.
[[noreturn]] void TakeBack(Client* client, const std::vector<std::string>& jobs) {
    client->Resume();
    std::size_t cancelled = 0;
    for (const std::string& job : jobs) {
        client->Cancel(job, true);
        ++cancelled;
    }
    throw Error(ErrorCode::kCancelled,
                fmt::format("interrupted; {} jobs were cancelled", cancelled));
}

// One job a frame, in one group.
int SubmitFrames(const SubmitOptions& options, Interrupts* interrupts) {
    const Endpoint server = RequireServer(options.server);
    if (options.job.budgets.time_limit) {
        ThrowInvalidArgument(
            "--time-limit counts from a job's making, and frames wait for one another: give --spp "
            "or --target, or `relume render --frames`");
    }
    ProgressMeter meter(ChooseProgressStyle(options.talk.quiet, stderr), stderr);
    PreparedJob prepared = PrepareFrames(options.job, options.frames);
    for (const auto& note : prepared.notes) {
        meter.Note("note: " + note);
    }
    const std::string group = MakeGroupName();
    const auto& frames = options.frames.frames;
    std::vector<std::string> made;
    Client client(server);
    const Interrupts::Guard guard(interrupts, [&] { client.Interrupt(); });
    try {
        SetFrame(group, frames.front(), options.frames.fps, &prepared.spec);
        client.Validate(prepared.spec);
        client.UploadScene(prepared.scene,
                           [&](std::uint64_t done, std::uint64_t due) { meter.Upload(done, due); });
        for (const int frame : frames) {
            SetFrame(group, frame, options.frames.fps, &prepared.spec);
            made.push_back(client.Create(prepared.spec).name());
        }
    } catch (const Error& error) {
        meter.Clear();
        if (interrupts->signal() != 0) {
            TakeBack(&client, made);
        }
        if (made.empty()) {
            throw;
        }
        throw Error(
            error.code(),
            fmt::format("{}; frames {} were submitted before, as {}", error.what(),
                        FormatFrames({frames.begin(),
                                      frames.begin() + static_cast<std::ptrdiff_t>(made.size())}),
                        group));
    }
    meter.Clear();
    if (!options.talk.json) {
        fmt::print("{}\n", group);
        return kExitDone;
    }
    nlohmann::ordered_json json{{"group", group}, {"jobs", nlohmann::ordered_json::array()}};
    for (std::size_t i = 0; i < made.size(); ++i) {
        json["jobs"].push_back({{"frame", frames[i]},
                                {"time", FrameTime(frames[i], options.frames.fps)},
                                {"job", made[i]}});
    }
    fmt::print("{}\n", json.dump());
    return kExitDone;
}

int RunSubmit(const SubmitOptions& options) {
    const Endpoint server = RequireServer(options.server);
    ProgressMeter meter(ChooseProgressStyle(options.talk.quiet, stderr), stderr);
    const PreparedJob prepared = PrepareJob(options.job);
    for (const auto& note : prepared.notes) {
        meter.Note("note: " + note);
    }
    Client client(server);
    client.Validate(prepared.spec);
    client.UploadScene(prepared.scene,
                       [&](std::uint64_t done, std::uint64_t due) { meter.Upload(done, due); });
    const v1::Job job = client.Create(prepared.spec);
    meter.Clear();
    if (options.talk.json) {
        fmt::print("{}\n", nlohmann::ordered_json{{"job", job.name()}}.dump());
    } else {
        fmt::print("{}\n", job.name());
    }
    return kExitDone;
}

}  // namespace

Runner AddSubmit(CLI::App* app) {
    const auto options = std::make_shared<SubmitOptions>();
    AddJobOptions(app, &options->job);
    AddFrameOptions(app, &options->frames);
    AddServerOption(app, &options->server);
    AddQuietOption(app, &options->talk);
    AddJsonOption(app, &options->talk);
    return [options](Interrupts* interrupts) {
        return options->frames.frames.empty() ? RunSubmit(*options)
                                              : SubmitFrames(*options, interrupts);
    };
}

}  // namespace relume::client
