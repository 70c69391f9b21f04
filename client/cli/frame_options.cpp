#include "client/cli/frame_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "client/cli/exit_codes.h"

namespace relume::client {
namespace {

constexpr double kMaxFps = 100'000;
constexpr std::size_t kReasonsTold = 3;

std::optional<FramePattern> PatternOf(const char* option, const std::string& text) {
    return text.empty() ? std::nullopt : std::optional(FramePattern(option, text));
}

bool IsThere(const std::string& path) {
    std::error_code ignored;
    return path.empty() || (std::filesystem::is_regular_file(path, ignored) &&
                            std::filesystem::file_size(path, ignored) > 0);
}

}  // namespace

void AddFrameOptions(CLI::App* app, FrameOptions* options) {
    auto* frames =
        app->add_option_function<std::string>(
               "--frames",
               [options](const std::string& text) { options->frames = ParseFrames(text); },
               "frames of the scene's animation, one picture each: 1-48, 1-48x2 (every "
               "second), 1,5,9; frame N is at N / fps seconds")
            ->excludes("--time")
            ->type_name("RANGE");
    app->add_option_function<std::string>(
           "--fps",
           [options](const std::string& text) {
               options->fps = ParsePositive("--fps", kMaxFps, text);
           },
           "frames a second [24]")
        ->needs(frames)
        ->type_name("N");
}

PreparedJob PrepareFrames(JobOptions job, const FrameOptions& options) {
    job.time = FrameTime(options.frames.front(), options.fps);
    PreparedJob prepared = PrepareJob(job);
    if (!(prepared.animation_seconds > 0)) {
        throw CommandError(
            kExitInput,
            fmt::format("{}: nothing moves in this scene: all frames would be the same picture; "
                        "export it with its animation, or leave out --frames",
                        job.scene));
    }
    std::vector<int> late;
    std::copy_if(
        options.frames.begin(), options.frames.end(), std::back_inserter(late), [&](int frame) {
            return static_cast<double>(FrameTime(frame, options.fps)) > prepared.animation_seconds;
        });
    if (!late.empty()) {
        prepared.notes.push_back(fmt::format(
            "the animation ends at {:.4g} s, which is frame {:.4g}: frames {} show its end",
            prepared.animation_seconds, prepared.animation_seconds * options.fps,
            FormatFrames(late)));
    }
    return prepared;
}

void SetFrame(const std::string& group, int frame, double fps, v1::JobSpec* spec) {
    spec->set_group(group);
    spec->set_frame(static_cast<std::uint32_t>(frame));
    spec->mutable_settings()->set_time(FrameTime(frame, fps));
}

void FailedFrames::Add(int frame, const std::string& why) {
    frames_.push_back(frame);
    if (reasons_.size() < kReasonsTold) {
        reasons_.push_back(fmt::format("frame {}: {}", frame, why));
    }
}

void FailedFrames::Throw(std::size_t all) const {
    if (frames_.empty()) {
        return;
    }
    const std::string more = frames_.size() > reasons_.size() ? "; ..." : "";
    throw CommandError(kExitJob,
                       fmt::format("{} of {} frames failed: {} ({}{})", frames_.size(), all,
                                   FormatFrames(frames_), fmt::join(reasons_, "; "), more));
}

FrameOutputs::FrameOutputs(const OutputOptions& patterns)
    : image_("-o", patterns.image),
      png_(PatternOf("--png", patterns.png)),
      report_(PatternOf("--report", patterns.report)) {}

OutputOptions FrameOutputs::Of(int frame) const {
    OutputOptions output;
    output.image = image_.Name(frame);
    output.png = png_ ? png_->Name(frame) : "";
    output.report = report_ ? report_->Name(frame) : "";
    return output;
}

bool FrameOutputs::Exist(int frame) const {
    const OutputOptions output = Of(frame);
    return IsThere(output.image) && IsThere(output.png) && IsThere(output.report);
}

}  // namespace relume::client
