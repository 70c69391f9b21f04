#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "client/cli/interrupts.h"
#include "client/cli/options.h"
#include "client/cli/prepare_job.h"
#include "client/cli/progress_meter.h"
#include "client/lib/client.h"
#include "client/lib/local_farm.h"
#include "client/lib/report.h"

namespace relume::client {

// Where a command has a job run that it waits for.
struct PlaceOptions {
    FarmOptions farm;
    ServerOptions given;
    Endpoint server;  // address "": the local farm
};
// --workers, --threads and --server. The function that comes back is to be called once they are
// read: it settles which of the two places it is.
std::function<void()> AddPlaceOptions(CLI::App* app, PlaceOptions* options);

// What becomes of work that is broken off.
struct Undertaking {
    std::vector<std::string> jobs;  // made for this command alone, and not over
    std::string outcome = "nothing was written";
};

// Starts the local farm, or reaches the server, and calls `work` with a client of it; `work` keeps
// `undertaking` up to date. An interruption cancels its jobs; then, and if anything fails, Error.
void WorkAt(const PlaceOptions& place, Interrupts* interrupts, ProgressMeter* meter,
            Undertaking* undertaking, const std::function<void(Client*)>& work);

// Runs a job to its success, from the upload of its scene on, and calls `finish` with the client
// that can fetch its result. `show` is called with the job as it goes on. Fills in the seconds of
// `facts` up to there, with those that are in `facts->check` in the total. What `finish` is
// expected to need, `save_seconds`, is kept back from a time limit. An interruption cancels the
// job; then, and if anything fails, Error.
void RunJob(const PreparedJob& prepared, const PlaceOptions& place, Interrupts* interrupts,
            ProgressMeter* meter, ReportFacts* facts, double save_seconds,
            const std::function<void(const v1::Job&)>& show,
            const std::function<void(Client*, const v1::Job&)>& finish);

}  // namespace relume::client
