#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/options.h"
#include "client/cli/prepare_job.h"
#include "client/lib/frames.h"
#include "relume/v1/jobs.pb.h"

namespace relume::client {

// --frames: one job for each frame of an animation.
struct FrameOptions {
    std::vector<int> frames;  // empty: one picture, as ever
    double fps = kDefaultFps;
};
// --frames and --fps; call it after AddJobOptions, whose --time they exclude.
void AddFrameOptions(CLI::App* app, FrameOptions* options);

// Checks and prepares the job of the first frame; the others differ in SetFrame's fields alone.
// Throws CommandError if nothing in the scene moves, so that all frames would be one picture.
PreparedJob PrepareFrames(JobOptions job, const FrameOptions& options);

// Makes the spec that of a frame of a group.
void SetFrame(const std::string& group, int frame, double fps, v1::JobSpec* spec);

// Frames that came to nothing, and why; in the order in which they were told.
class FailedFrames {
  public:
    void Add(int frame, const std::string& why);
    // Throws CommandError that lists them, if there are any, of `all` frames.
    void Throw(std::size_t all) const;
    bool empty() const { return frames_.empty(); }

  private:
    std::vector<int> frames_;
    std::vector<std::string> reasons_;  // of the first few
};

// Names with a place for the frame's number in each of those that are given.
class FrameOutputs {
  public:
    explicit FrameOutputs(const OutputOptions& patterns);
    OutputOptions Of(int frame) const;
    // Whether all files of the frame are there: they appear only when they are whole.
    bool Exist(int frame) const;

  private:
    FramePattern image_;
    std::optional<FramePattern> png_, report_;
};

}  // namespace relume::client
