#include "client/cli/render_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <deque>
#include <set>
#include <utility>

#include "client/cli/exit_codes.h"
#include "client/cli/job_result.h"
#include "client/cli/progress_meter.h"
#include "client/lib/job_group.h"
#include "core/base/error.h"

namespace relume::client {
namespace {

// Jobs that the server knows of at a time: while one is filtered and fetched, workers are at the
// next. More would only take memory there.
constexpr std::size_t kAhead = 4;

double Now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

class FrameRun {
  public:
    FrameRun(const RenderOptions& options, std::vector<int> frames, const PreparedJob& prepared,
             ReportFacts facts, ProgressMeter* meter, Undertaking* undertaking)
        : options_(options),
          outputs_(options.output),
          prepared_(prepared),
          facts_(std::move(facts)),
          meter_(meter),
          undertaking_(undertaking),
          count_(frames.size()),
          to_do_(frames.begin(), frames.end()),
          told_(facts_.notes.begin(), facts_.notes.end()) {}

    void Run(Client* client) {
        const double start = Now();
        client->Validate(SpecOf(to_do_.front()));
        client->UploadScene(prepared_.scene, [&](std::uint64_t done, std::uint64_t due) {
            meter_->Upload(done, due);
        });
        facts_.upload = Now() - start;
        begin_ = Now();
        try {
            while (!to_do_.empty() || !under_way_.empty()) {
                Begin(client);
                Await(client);
            }
        } catch (const OutputError&) {
            // No frame after it could be written either.
            for (const std::string& job : undertaking_->jobs) {
                client->Cancel(job, true);
            }
            throw;
        }
    }

    const FailedFrames& failed() const { return failed_; }
    nlohmann::ordered_json TakeJson() { return std::move(json_); }

  private:
    struct UnderWay {
        int frame = 0;
        std::string job;
        double begin = 0;
    };

    v1::JobSpec SpecOf(int frame) const {
        v1::JobSpec spec = prepared_.spec;
        SetFrame(group_, frame, options_.frames.fps, &spec);
        return spec;
    }

    // Makes jobs up to kAhead. A time limit counts from a job's making: with one, they are made one
    // by one.
    void Begin(Client* client) {
        const std::size_t ahead = prepared_.spec.has_time_limit() ? 1 : kAhead;
        while (!to_do_.empty() && under_way_.size() < ahead) {
            const int frame = to_do_.front();
            std::string name;
            try {
                name = client->Create(SpecOf(frame)).name();
            } catch (const Error& error) {
                // Over the server's quota until one of ours is over.
                if (error.code() == ErrorCode::kResourceExhausted && !under_way_.empty()) {
                    return;
                }
                throw;
            }
            to_do_.pop_front();
            under_way_.push_back({frame, name, Now()});
            undertaking_->jobs.push_back(name);
        }
    }

    // Waits for the oldest job and saves its image.
    void Await(Client* client) {
        const UnderWay current = under_way_.front();
        meter_->Announce(Progress(current.frame));
        const v1::Job last =
            client->Watch(current.job, [&](const v1::Job& job) { meter_->Update(job); });
        meter_->Clear();
        under_way_.pop_front();
        std::erase(undertaking_->jobs, current.job);
        try {
            RequireSuccess(last);
        } catch (const CommandError& error) {
            failed_.Add(current.frame, error.what());
            meter_->Warn(fmt::format("relume: frame {}: {}", current.frame, error.what()));
            json_["failed"].push_back(
                {{"frame", current.frame}, {"job", current.job}, {"message", error.what()}});
            ++over_;
            return;
        }
        const v1::Job job = client->Get(current.job);
        ReportFacts facts = facts_;
        facts.job = Now() - current.begin;
        facts.total = facts.check + facts.start + facts.upload + facts.job;
        const OutputOptions output = outputs_.Of(current.frame);
        SaveResult(client, job, output, &facts);
        ++over_;
        ++written_;
        undertaking_->outcome = fmt::format(
            "{} of {} frames are written; --skip-existing goes on "
            "from there",
            written_, count_);
        TellNotes(job);
        Tell(job, current.frame, output);
    }

    // "frame 12, 3 of 48 done, 12 min left: "
    std::string Progress(int frame) const {
        std::string text = fmt::format("frame {}, {} of {} done", frame, over_, count_);
        if (over_ > 0) {
            const double each = (Now() - begin_) / static_cast<double>(over_);
            text += fmt::format(", {} left in all",
                                FormatDuration(each * static_cast<double>(count_ - over_)));
        }
        return text + ": ";
    }

    void TellNotes(const v1::Job& job) {
        for (const auto& note : job.notes()) {
            if (told_.insert(note).second) {
                meter_->Note("note: " + note);
            }
        }
    }

    void Tell(const v1::Job& job, int frame, const OutputOptions& output) {
        if (!options_.talk.json) {
            fmt::print("{}: image digest {}\n", output.image, job.image_sha256());
            std::fflush(stdout);
            return;
        }
        auto json = JobJson(job);
        json["time"] = job.spec().settings().time();
        json["image"] = output.image;
        json["png"] = OrNull(!output.png.empty(), output.png);
        json["report"] = OrNull(!output.report.empty(), output.report);
        json["frame"] = frame;
        json_["frames"].push_back(std::move(json));
    }

    const RenderOptions& options_;
    const FrameOutputs outputs_;
    const PreparedJob& prepared_;
    ReportFacts facts_;  // up to the first job
    ProgressMeter* meter_;
    Undertaking* undertaking_;
    const std::string group_ = MakeGroupName();
    const std::size_t count_;
    std::deque<int> to_do_;
    std::deque<UnderWay> under_way_;  // oldest first
    std::size_t over_ = 0, written_ = 0;
    double begin_ = 0;
    FailedFrames failed_;
    std::set<std::string> told_;
    nlohmann::ordered_json json_{{"frames", nlohmann::ordered_json::array()},
                                 {"failed", nlohmann::ordered_json::array()}};
};

}  // namespace

int RenderFrames(const RenderOptions& options, Interrupts* interrupts) {
    ProgressMeter meter(ChooseProgressStyle(options.talk.quiet, stderr), stderr);
    const double start = Now();
    const FrameOutputs outputs(options.output);
    std::vector<int> frames, skipped;
    for (const int frame : options.frames.frames) {
        const bool skip = options.skip_existing && outputs.Exist(frame);
        (skip ? skipped : frames).push_back(frame);
    }
    if (!skipped.empty()) {
        meter.Note(fmt::format("note: frames {} are there and are skipped", FormatFrames(skipped)));
    }

    Undertaking undertaking;
    nlohmann::ordered_json json{{"frames", nlohmann::ordered_json::array()},
                                {"failed", nlohmann::ordered_json::array()}};
    FailedFrames failed;
    if (!frames.empty()) {
        {
            const Interrupts::Guard whole(interrupts);  // leaves no probe behind
            CheckOutputs(outputs.Of(frames.front()));
        }
        interrupts->Check();
        FrameOptions wanted = options.frames;
        wanted.frames = frames;
        const PreparedJob prepared = PrepareFrames(options.job, wanted);
        for (const auto& note : prepared.notes) {
            meter.Note("note: " + note);
        }
        ReportFacts facts;
        facts.scene = prepared.scene.manifest;
        facts.notes = prepared.notes;
        facts.time_limit = options.job.budgets.time_limit;
        facts.check = Now() - start;
        const double begin = Now();
        WorkAt(options.place, interrupts, &meter, &undertaking, [&](Client* client) {
            facts.start = Now() - begin;
            FrameRun run(options, frames, prepared, facts, &meter, &undertaking);
            run.Run(client);
            failed = run.failed();
            json = run.TakeJson();
        });
    }
    if (options.talk.json) {
        json["skipped"] = skipped;
        fmt::print("{}\n", json.dump(2));
    }
    failed.Throw(options.frames.frames.size());
    return kExitDone;
}

}  // namespace relume::client
