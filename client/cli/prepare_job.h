#pragma once

#include <string>
#include <vector>

#include "client/cli/options.h"
#include "client/lib/scene_files.h"
#include "relume/v1/jobs.pb.h"

namespace relume::client {

// A job that has passed the checks of this machine.
struct PreparedJob {
    LocalScene scene;
    v1::JobSpec spec;
    std::vector<std::string> notes;
    double animation_seconds =
        0;  // when the last thing in the scene comes to rest; 0: nothing moves
};

// Collects and checks the scene. Throws CommandError: what is wrong with the scene, or with the
// options on their own.
PreparedJob PrepareJob(const JobOptions& options);

}  // namespace relume::client
