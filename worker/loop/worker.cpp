#include "worker/loop/worker.h"

#include <fmt/format.h>
#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <utility>

#include "core/base/error.h"
#include "core/base/log.h"
#include "core/film/aov.h"
#include "proto/codec/codec.h"
#include "proto/codec/digests.h"
#include "proto/codec/protocol.h"
#include "proto/codec/status.h"
#include "worker/loop/blob_fetch.h"
#include "worker/loop/messages.h"

namespace relume::worker {
namespace {

constexpr double kWelcomeSeconds = 10;
constexpr double kGoodbyeSeconds = 0.5;
constexpr std::chrono::milliseconds kLastWordsTime{900};
constexpr double kTickSeconds = 0.1;  // between looks at the clock before the Welcome
constexpr double kMinBackoffSeconds = 0.1, kMaxBackoffSeconds = 5;
// Enough that a thread never waits for the wire, few enough that a pass ends evenly.
constexpr int kLeasesPerThread = 3;
// For leases of a stream that broke, once there are others.
constexpr double kStaleSeconds = 5;
constexpr std::size_t kMaxKeptBytes = std::size_t{256} << 20;  // of answers not acknowledged

}  // namespace

Worker::Worker(WorkerOptions options, SceneLoader loader)
    : options_(Checked(std::move(options))),
      channel_(MakeChannel(options_)),
      work_stub_(v1::WorkerService::NewStub(channel_)),
      cache_(options_.cache_folder, options_.cache_bytes),
      kept_(kMaxKeptBytes) {
    JobScenes::Handler handler;
    handler.on_ready = [this](const std::string& job, std::shared_ptr<const LoadedScene> scene,
                              double seconds) {
        const LogScope scope({.job = job});
        spdlog::info("{}: scene ready after {:.2f} s", job, seconds);
        Send(MakeSceneReady(job, scene->notes, seconds));
        leases_.SetScene(job, std::move(scene));
    };
    handler.on_problem = [this](const std::string& job, const std::string& message,
                                bool transient) {
        SendProblem(job, message, transient);
        ReturnLeases(leases_.DropJob(job));
    };
    scenes_ =
        std::make_unique<JobScenes>(&cache_, MakeBlobFetch(channel_, options_.server, &stopping_),
                                    std::move(loader), std::move(handler));
    for (int i = 0; i < options_.threads; ++i) {
        render_threads_.emplace_back([this] { RenderThread(); });
    }
}

Worker::~Worker() {
    stopping_.Cancel();
    leases_.Close();
    leases_.CancelRunning();
    for (auto& thread : render_threads_) {
        thread.join();
    }
    scenes_.reset();
}

void Worker::Stop() {
    stopping_.Cancel();
    Post({Event::kStop, {}, {}});
}

void Worker::SayLastWords(const Crash& crash) {
    std::shared_ptr<WorkStream> stream;
    {
        const std::lock_guard lock(mutex_);
        stream = stream_;
    }
    if (!stream) {
        return;
    }
    stream->Send(MakeLastWords(crash));
    stream->WaitUntilClosed(kLastWordsTime);
}

void Worker::Post(Event event) {
    const std::lock_guard lock(mutex_);
    inbox_.push_back(std::move(event));
    posted_.notify_all();
}

bool Worker::NextEvent(double seconds, Event* event) {
    std::unique_lock lock(mutex_);
    if (!posted_.wait_for(lock, FromSeconds(seconds), [&] { return !inbox_.empty(); })) {
        return false;
    }
    *event = std::move(inbox_.front());
    inbox_.pop_front();
    return true;
}

void Worker::Run() {
    // The jitter keeps a rack of workers from coming back in step.
    std::mt19937 random(std::random_device{}());
    double backoff = kMinBackoffSeconds;
    bool said = false;
    while (!stopping_.cancelled()) {
        const grpc::Status status = Serve();
        if (stopping_.cancelled() || leaving_) {
            break;
        }
        if (status.error_code() == grpc::StatusCode::FAILED_PRECONDITION ||
            status.error_code() == grpc::StatusCode::UNIMPLEMENTED) {
            throw Error(ErrorCode::kFailedPrecondition,
                        fmt::format("{}: the server refuses this worker ({}, protocol {}): {}",
                                    options_.server, kBuild, kProtocolVersion,
                                    codec::FromStatus(status, options_.server).what()));
        }
        if (welcomed_) {
            backoff = kMinBackoffSeconds;
            said = false;
        }
        if (!said) {
            const Error why = ExplainEnd(options_, status);
            // Who was let in before has the right credentials: what is wrong may be set right at
            // the server.
            if (!let_in_ && (why.code() == ErrorCode::kPermissionDenied ||
                             why.code() == ErrorCode::kUnauthenticated)) {
                throw why;
            }
            spdlog::warn("{}; trying again until it answers", why.what());
            said = true;
        }
        Event event;
        NextEvent(backoff * std::uniform_real_distribution<>(0.5, 1.5)(random), &event);
        backoff = std::min(2 * backoff, kMaxBackoffSeconds);
    }
}

grpc::Status Worker::Serve() {
    welcomed_ = draining_ = false;
    const auto stream = WorkStream::Open(work_stub_.get(), options_.join_token,
                                         {[this](v1::WorkResponse message) {
                                              Post({Event::kMessage, std::move(message), {}});
                                          },
                                          [this](const grpc::Status& status) {
                                              Post({Event::kClosed, {}, status});
                                          }});
    {
        const std::lock_guard lock(mutex_);
        stream_ = stream;
    }
    Send(MakeHello(options_));

    // A server that neither welcomes the worker nor lets it go is not waited for.
    TimePoint give_up = SteadyClock().Now() + FromSeconds(kWelcomeSeconds);
    TimePoint next_report{};
    Event event;
    for (;;) {
        const TimePoint now = SteadyClock().Now();
        if (now >= give_up) {
            stream->Cancel();
            give_up = TimePoint::max();
        }
        if (stale_until_ && now >= *stale_until_) {
            leases_.CancelOthers(stream.get());
            stale_until_ = TimePoint::max();
        }
        if (welcomed_ && now >= next_report) {
            Report();
            next_report = now + FromSeconds(report_seconds_);
        }
        if (!NextEvent(welcomed_ ? ToSeconds(next_report - now) : kTickSeconds, &event)) {
            continue;
        }
        if (event.kind == Event::kClosed) {
            break;
        }
        const bool was_welcomed = welcomed_;
        const bool was_draining = draining_;
        if (event.kind == Event::kMessage) {
            Handle(event.message);
        } else {
            draining_ = leaving_ = true;
        }
        if (welcomed_ && !was_welcomed) {
            give_up = TimePoint::max();
        }
        if (draining_ && !was_draining) {
            Drain();
            stream->Finish();
            give_up = SteadyClock().Now() + FromSeconds(kGoodbyeSeconds);
        }
    }
    // The stream's end has returned all leases. Those that run are finished all the same: their
    // answers may still be wanted.
    leases_.DropAll();
    scenes_->ForgetJobs();
    context_digests_.clear();
    const std::lock_guard lock(mutex_);
    stream_.reset();
    answers_to_.reset();
    return event.status;
}

void Worker::Handle(const v1::WorkResponse& message) {
    switch (message.message_case()) {
        case v1::WorkResponse::kWelcome:
            welcomed_ = let_in_ = true;
            report_seconds_ = std::clamp(message.welcome().report_seconds(), 0.05, 60.0);
            SetLogWorker(message.welcome().name());
            spdlog::info("works for {} as {} with {} threads", options_.server,
                         message.welcome().name(), options_.threads);
            stale_until_.reset();
            SendKept();
            break;
        case v1::WorkResponse::kJob:
            HandleJob(message.job());
            break;
        case v1::WorkResponse::kLease:
            HandleLease(message.lease());
            break;
        case v1::WorkResponse::kRevoke: {
            const auto& ids = message.revoke().lease_ids();
            ReturnLeases(leases_.Drop({ids.begin(), ids.end()}, stream_.get()));
            break;
        }
        case v1::WorkResponse::kDrain:
            draining_ = true;
            leaving_ = leaving_ || !message.drain().come_back();
            break;
        case v1::WorkResponse::kJobOver:
            scenes_->Forget(message.job_over().job());
            context_digests_.erase(message.job_over().job());
            ReturnLeases(leases_.DropJob(message.job_over().job()));
            break;
        case v1::WorkResponse::kAcknowledge: {
            const std::lock_guard lock(mutex_);
            for (const auto& ticket : message.acknowledge().tickets()) {
                kept_.Drop(ticket);
            }
            break;
        }
        case v1::WorkResponse::MESSAGE_NOT_SET:
            break;
    }
}

void Worker::HandleJob(const v1::JobContext& context) {
    try {
        if (!std::equal(context.channels().begin(), context.channels().end(),
                        FilmChannelNames().begin(), FilmChannelNames().end())) {
            ThrowInvalidArgument("the server asks for other channels than " + std::string(kBuild) +
                                 " makes; use workers and server of one version");
        }
        const SceneManifest manifest = codec::FromProto(context.scene());
        const RenderSettings settings = codec::FromProto(context.settings());
        context_digests_[context.job()] = codec::ContextDigest(context.job(), manifest, settings);
        scenes_->Add(context.job(), manifest, settings);
    } catch (const Error& error) {
        SendProblem(context.job(), error.what(), false);
    }
}

void Worker::HandleLease(const v1::Lease& lease) {
    HeldLease held;
    held.id = lease.id();
    held.job = lease.job();
    held.epoch = lease.epoch();
    held.unit = lease.unit();
    held.ticket = lease.ticket();
    try {
        held.task = codec::TaskFromLease(lease);
    } catch (const Error& error) {
        // No server makes such a lease: it was damaged on its way, which is not the job's fault.
        SendProblem(lease.job(), error.what(), true);
        ReturnLeases({lease.id()});
        return;
    }
    if (draining_ || !scenes_->Knows(lease.job())) {
        ReturnLeases({lease.id()});
        return;
    }
    held.task_digest = codec::TaskDigest(context_digests_.at(lease.job()), lease.unit(), held.task);
    {
        const std::lock_guard lock(mutex_);
        held.stream = stream_;
    }
    if (!stale_until_) {
        stale_until_ = SteadyClock().Now() + FromSeconds(kStaleSeconds);
    }
    // Into the queue first: a scene that gets ready in between finds the lease there.
    leases_.Push(std::move(held));
    if (auto scene = scenes_->Want(lease.job())) {
        leases_.SetScene(lease.job(), std::move(scene));
    }
}

void Worker::Drain() {
    spdlog::info("drains, with {} leases held", leases_.held());
    ReturnLeases(leases_.DropAll());
    Report();
    const auto limit = std::chrono::milliseconds(static_cast<int>(kDrainSeconds * 1000));
    while (!leases_.WaitIdle(limit)) {
        if (stopping_.cancelled()) {
            leases_.CancelRunning();
            leases_.WaitIdle(std::chrono::milliseconds(200));
            return;
        }
        Report();  // the server's own drain leaves the leases their time
    }
}

void Worker::RenderThread() {
    pthread_setname_np(pthread_self(), "render");
    while (auto lease = leases_.Take()) {
        const LogScope scope({.job = lease->job, .lease = lease->id});
        v1::WorkRequest message = MakeLeaseReturn({lease->id});
        try {
            const CrashScope crash_scope(lease->job, lease->id);
            const TileResult result = lease->scene->render(lease->task, *lease->cancel);
            if (!lease->cancel->cancelled()) {
                for (v1::WorkRequest& samples : MakeSamples(*lease, result)) {
                    lease->stream->Send(std::move(samples));
                }
                message = MakeResult(*lease, result);
                spdlog::debug("{}: lease {} took {:.3f} s", lease->job, lease->id, result.seconds);
            }
        } catch (const std::exception& error) {
            const TileRect& r = lease->task.rect;
            spdlog::error("{}: lease {} over pixels {},{},{},{} failed: {}", lease->job, lease->id,
                          r.x0, r.y0, r.x1, r.y1, error.what());
            lease->stream->Send(MakeProblem(lease->job, error.what(), true));
        }
        if (message.result().ticket().empty()) {
            lease->stream->Send(std::move(message));
        } else {
            Answer(message);
        }
        leases_.Finish(*lease);
    }
}

// Streams are used without the lock: they may tell of their end on this thread.
void Worker::Answer(const v1::WorkRequest& message) {
    std::shared_ptr<WorkStream> stream;
    {
        const std::lock_guard lock(mutex_);
        kept_.Keep(message);
        stream = answers_to_;
    }
    if (stream) {
        stream->Send(message);
    }
}

void Worker::SendKept() {
    std::shared_ptr<WorkStream> stream;
    std::vector<v1::WorkRequest> kept;
    {
        const std::lock_guard lock(mutex_);
        stream = answers_to_ = stream_;
        kept = kept_.All();
    }
    if (!kept.empty()) {
        spdlog::info("hands in {} results that were not acknowledged", kept.size());
    }
    for (auto& message : kept) {
        stream->Send(std::move(message));
    }
}

void Worker::Report() {
    Send(MakeReport(draining_ ? 0 : kLeasesPerThread * options_.threads, leases_.held()));
}

void Worker::ReturnLeases(const std::vector<std::uint64_t>& ids) {
    if (!ids.empty()) {
        Send(MakeLeaseReturn(ids));
    }
}

void Worker::SendProblem(const std::string& job, const std::string& message, bool transient) {
    const LogScope scope({.job = job});
    spdlog::warn("{}: {}", job, message);
    Send(MakeProblem(job, message, transient));
}

void Worker::Send(v1::WorkRequest message) {
    std::shared_ptr<WorkStream> stream;
    {
        const std::lock_guard lock(mutex_);
        stream = stream_;
    }
    if (stream) {
        stream->Send(std::move(message));
    }
}

}  // namespace relume::worker
