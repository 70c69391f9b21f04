// relume render: from a scene to an image in one go, on a local farm or on a server.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/job_result.h"
#include "client/cli/options.h"
#include "client/cli/prepare_job.h"
#include "client/cli/progress_meter.h"
#include "client/cli/render_frames.h"
#include "client/cli/run_job.h"

namespace relume::client {
namespace {

// Seconds from the job's end to the command's: fetching, checking and writing, making the view,
// ending the farm.
double SaveSeconds(const v1::JobSpec& spec, bool png, bool local) {
    constexpr double kAlways = 0.1, kFarm = 0.2, kFetchMegapixel = 0.15, kViewMegapixel = 0.8;
    const double megapixels = 1e-6 * PixelsOf(spec);
    return kAlways + (local ? kFarm : 0) +
           megapixels * (kFetchMegapixel + (png ? kViewMegapixel : 0));
}

void PrintResult(const RenderOptions& options, const v1::Job& job) {
    if (options.talk.json) {
        auto json = JobJson(job);
        json["image"] = options.output.image;
        json["png"] = options.output.png.empty() ? nlohmann::ordered_json(nullptr)
                                                 : nlohmann::ordered_json(options.output.png);
        json["report"] = options.output.report.empty()
                             ? nlohmann::ordered_json(nullptr)
                             : nlohmann::ordered_json(options.output.report);
        fmt::print("{}\n", json.dump(2));
        return;
    }
    fmt::print("{}\n{}: image digest {}\n", DescribeJob(job), options.output.image,
               job.image_sha256());
}

int RunRender(const RenderOptions& options, Interrupts* interrupts) {
    ProgressMeter meter(ChooseProgressStyle(options.talk.quiet, stderr), stderr);
    ReportFacts facts;
    const auto start = std::chrono::steady_clock::now();
    {
        const Interrupts::Guard whole(interrupts);  // leaves no probe behind
        CheckOutputs(options.output);
    }
    interrupts->Check();
    const PreparedJob prepared = PrepareJob(options.job);
    facts.scene = prepared.scene.manifest;
    facts.notes = prepared.notes;
    facts.time_limit = options.job.budgets.time_limit;
    for (const auto& note : prepared.notes) {
        meter.Note("note: " + note);
    }
    facts.check = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

    RunJob(
        prepared, options.place, interrupts, &meter, &facts,
        SaveSeconds(prepared.spec, !options.output.png.empty(),
                    options.place.server.address.empty()),
        [&](const v1::Job& job) { meter.Update(job); },
        [&](Client* client, const v1::Job& job) {
            SaveResult(client, job, options.output, &facts);
            for (const auto& note : job.notes()) {
                if (std::find(facts.notes.begin(), facts.notes.end(), note) == facts.notes.end()) {
                    meter.Note("note: " + note);
                }
            }
            PrintResult(options, job);
        });
    return kExitDone;
}

}  // namespace

Runner AddRender(CLI::App* app) {
    const auto options = std::make_shared<RenderOptions>();
    AddJobOptions(app, &options->job);
    AddFrameOptions(app, &options->frames);
    app->add_flag("--skip-existing", options->skip_existing,
                  "leave out frames whose files are there: goes on with what was broken off")
        ->needs("--frames");
    AddOutputOptions(app, &options->output);
    const auto settle = AddPlaceOptions(app, &options->place);
    AddQuietOption(app, &options->talk);
    AddJsonOption(app, &options->talk);
    return [=](Interrupts* interrupts) {
        settle();
        if (!options->frames.frames.empty()) {
            return RenderFrames(*options, interrupts);
        }
        return RunRender(*options, interrupts);
    };
}

}  // namespace relume::client
