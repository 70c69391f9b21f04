#pragma once

#include "client/cli/frame_options.h"
#include "client/cli/interrupts.h"
#include "client/cli/options.h"
#include "client/cli/run_job.h"

namespace relume::client {

// What `relume render` is asked for.
struct RenderOptions {
    JobOptions job;
    OutputOptions output;  // of frames: patterns
    FrameOptions frames;
    bool skip_existing = false;  // frames whose files are there
    TalkOptions talk;
    PlaceOptions place;
};

// Renders each of options.frames to its own files, some jobs ahead of the one that is waited for. A
// frame that fails keeps no other from being rendered. Answers with the exit code; throws
// CommandError if frames failed, Error if an interruption or anything else ended it.
int RenderFrames(const RenderOptions& options, Interrupts* interrupts);

}  // namespace relume::client
