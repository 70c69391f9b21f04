#include "client/cli/fetch_frames.h"

#include <fmt/format.h>

#include <cstdio>
#include <map>

#include "client/cli/exit_codes.h"
#include "client/cli/frame_options.h"
#include "client/cli/job_result.h"
#include "client/lib/job_group.h"
#include "core/base/error.h"
#include "proto/codec/codec.h"

namespace relume::client {

int FetchFrames(Client* client, const std::vector<std::string>& names,
                const OutputOptions& patterns, bool skip_existing) {
    const FrameOutputs outputs(patterns);
    std::map<int, v1::Job> frames;
    for (const v1::Job& job : FindJobs(client, names)) {
        if (!job.spec().has_frame()) {
            ThrowInvalidArgument(
                fmt::format("{} is not the frame of an animation; fetch it by itself", job.name()));
        }
        const auto [it, is_new] = frames.emplace(static_cast<int>(job.spec().frame()), job);
        if (!is_new) {
            ThrowInvalidArgument(fmt::format("{} and {} are both frame {}; fetch them apart",
                                             it->second.name(), job.name(), it->first));
        }
    }
    FailedFrames failed;
    for (const auto& [frame, listed] : frames) {
        if (skip_existing && outputs.Exist(frame)) {
            continue;
        }
        try {
            RequireSuccess(listed);
        } catch (const CommandError& error) {
            failed.Add(frame, error.what());
            continue;
        }
        const OutputOptions output = outputs.Of(frame);
        CheckOutputs(output);
        const v1::Job job = client->Get(listed.name());
        ReportFacts facts;
        facts.scene = codec::FromProto(job.spec().scene());
        facts.job = facts.total = SecondsOf(job);
        SaveResult(client, job, output, &facts);
        fmt::print("{}: image digest {}\n", output.image, job.image_sha256());
        std::fflush(stdout);
    }
    failed.Throw(frames.size());
    return kExitDone;
}

}  // namespace relume::client
