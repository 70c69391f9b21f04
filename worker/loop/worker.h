#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/base/cancel_token.h"
#include "core/base/clock.h"
#include "relume/v1/work.grpc.pb.h"
#include "worker/loop/blob_cache.h"
#include "worker/loop/crash_report.h"
#include "worker/loop/job_scenes.h"
#include "worker/loop/kept_results.h"
#include "worker/loop/lease_queue.h"
#include "worker/loop/scene_loader.h"
#include "worker/loop/work_stream.h"
#include "worker/loop/worker_options.h"

namespace relume::worker {

// Works for one server until told to stop: takes leases, renders them, sends results; reconnects
// for ever when the server is away. What runs meanwhile is finished, and handed in afterwards with
// all else that the server has not acknowledged.
class Worker {
  public:
    // Throws kInvalidArgument if a join token would cross a network in the clear.
    Worker(WorkerOptions options, SceneLoader loader);
    ~Worker();

    // Returns after Stop, or when the server wants it to leave for good. Throws kFailedPrecondition
    // if the server refuses this version, kPermissionDenied or kUnauthenticated if it or TLS does
    // not let this worker in that it never had let in before.
    void Run();

    // Thread-safe. Leases not begun go back, those running get kDrainSeconds to finish and then go
    // back, too.
    void Stop();

    // The process dies: tells the server where, and waits until that has heard it, a little less
    // than a second at most. Thread-safe.
    void SayLastWords(const Crash& crash);

    // True while a scene is being loaded, which nothing can interrupt: the destructor waits for it.
    bool loading() const { return scenes_->busy(); }

    static constexpr double kDrainSeconds = 0.6;

  private:
    // What the stream and Stop tell the control thread.
    struct Event {
        enum Kind { kMessage, kClosed, kStop } kind;
        v1::WorkResponse message;
        grpc::Status status;
    };
    void Post(Event event);
    // The next event, or nothing after `seconds`.
    bool NextEvent(double seconds, Event* event);

    // One stream from Hello to its end.
    grpc::Status Serve();
    void Handle(const v1::WorkResponse& message);
    void HandleJob(const v1::JobContext& context);
    void HandleLease(const v1::Lease& lease);
    // Hands back what has not begun, waits for what has, and says goodbye.
    void Drain();
    void RenderThread();
    void Report();
    void ReturnLeases(const std::vector<std::uint64_t>& ids);
    void SendProblem(const std::string& job, const std::string& message, bool transient);
    void Send(v1::WorkRequest message);
    // Keeps an answer until it is acknowledged, and sends it if there is somebody to send it to.
    void Answer(const v1::WorkRequest& message);
    // All that was kept goes to the stream that is open now, as will what is kept from here on.
    void SendKept();

    WorkerOptions options_;
    std::shared_ptr<grpc::Channel> channel_;
    std::unique_ptr<v1::WorkerService::Stub> work_stub_;
    BlobCache cache_;
    LeaseQueue leases_;
    std::unique_ptr<JobScenes> scenes_;
    std::vector<std::thread> render_threads_;
    CancelToken stopping_;

    // Of the control thread.
    double report_seconds_ = 1;
    std::optional<TimePoint> stale_until_;  // what runs of earlier streams is given up then
    bool welcomed_ = false;                 // by the current stream
    bool let_in_ = false;                   // by any stream
    bool draining_ = false;                 // no more leases wanted from it
    bool leaving_ = false;                  // for good
    std::map<std::string, std::uint64_t> context_digests_;  // of the jobs that the stream told of

    std::mutex mutex_;  // guards all below
    std::condition_variable posted_;
    std::deque<Event> inbox_;
    std::shared_ptr<WorkStream> stream_;
    std::shared_ptr<WorkStream> answers_to_;  // stream_, once it is welcomed
    KeptResults kept_;
};

}  // namespace relume::worker
