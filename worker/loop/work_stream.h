#pragma once

#include <grpcpp/client_context.h>
#include <grpcpp/support/client_callback.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "relume/v1/work.grpc.pb.h"

namespace relume::worker {

// One WorkerService.Work stream: one read and one write in flight, what is to be sent waits in a
// queue. How long that queue gets is bounded by the leases that a worker holds. Thread-safe.
class WorkStream final : public grpc::ClientBidiReactor<v1::WorkRequest, v1::WorkResponse> {
  public:
    // Both are called on threads of gRPC and must not block; on_closed once, last of all.
    struct Handler {
        std::function<void(v1::WorkResponse)> on_message;
        std::function<void(const grpc::Status&)> on_closed;
    };

    // Opens the stream, showing the join token unless it is "". It keeps itself alive until
    // on_closed is called; the channel must live until then.
    static std::shared_ptr<WorkStream> Open(v1::WorkerService::Stub* stub,
                                            const std::string& join_token, Handler handler);

    // Dropped if the stream is closed.
    void Send(v1::WorkRequest message);
    // Says goodbye after everything that waits has been sent.
    void Finish();
    void Cancel() { context_.TryCancel(); }
    // False if it was still open when the time was up.
    bool WaitUntilClosed(std::chrono::milliseconds limit);

    void OnReadDone(bool ok) override;
    void OnWriteDone(bool ok) override;
    void OnDone(const grpc::Status& status) override;

  private:
    explicit WorkStream(Handler handler) : handler_(std::move(handler)) {}

    // Starts the next write or ends writing. The hold taken in Open keeps the call alive until
    // writing has ended, so that Send may start a write from any thread.
    void Advance(std::unique_lock<std::mutex> lock);

    Handler handler_;
    grpc::ClientContext context_;
    v1::WorkResponse incoming_;
    std::shared_ptr<WorkStream> self_;  // until OnDone

    std::mutex mutex_;  // guards all below
    std::deque<v1::WorkRequest> outbox_;
    v1::WorkRequest outgoing_;
    bool writing_ = false;    // a write is in flight
    bool finishing_ = false;  // half-close when the outbox is empty
    bool broken_ = false;     // nothing can be written any more
    bool ended_ = false;      // the hold is gone
    bool closed_ = false;
    std::condition_variable closing_;
};

}  // namespace relume::worker
