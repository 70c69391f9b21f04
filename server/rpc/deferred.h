#pragma once

#include <grpcpp/support/server_callback.h>

#include <functional>
#include <utility>

#include "server/rpc/executor.h"
#include "server/rpc/status.h"
#include "server/rpc/stream_limit.h"

namespace relume::server {

// A unary call that is answered by `body` on `executor`; what it throws becomes the status.
template <typename Body>
grpc::ServerUnaryReactor* Deferred(grpc::CallbackServerContext* context, SerialExecutor* executor,
                                   Body body) {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    executor->Post([reactor, body = std::move(body)] { reactor->Finish(Guard(body)); });
    return reactor;
}

// Answers with a stream of pieces that `fill` makes one by one on `executor`: false after the last
// one. What has to be known before is asked by `prepare` on another executor. Either may throw.
// Deletes itself.
template <typename Response>
class PieceStream final : public grpc::ServerWriteReactor<Response> {
  public:
    using Fill = std::function<bool(Response*)>;

    PieceStream(StreamLimit::Slot slot, SerialExecutor* executor, Fill fill)
        : slot_(std::move(slot)), executor_(executor), fill_(std::move(fill)) {
        executor_->Post([this] { Next(); });
    }
    PieceStream(StreamLimit::Slot slot, SerialExecutor* prepare_executor,
                std::function<void()> prepare, SerialExecutor* executor, Fill fill)
        : slot_(std::move(slot)), executor_(executor), fill_(std::move(fill)) {
        prepare_executor->Post([this, prepare = std::move(prepare)] {
            if (const grpc::Status status = Guard(prepare); status.ok()) {
                executor_->Post([this] { Next(); });
            } else {
                this->Finish(status);
            }
        });
    }

    void OnWriteDone(bool ok) override {
        if (ok) {
            executor_->Post([this] { Next(); });
        } else {
            this->Finish({grpc::StatusCode::CANCELLED, "the reader went away"});
        }
    }
    void OnDone() override { delete this; }

  private:
    // A posted task or a write is under way, never both, and each ends in the other or in Finish:
    // so the object lives as long as it is needed.
    void Next() {
        bool more = false;
        response_.Clear();
        const grpc::Status status = Guard([&] { more = fill_(&response_); });
        if (more) {
            this->StartWrite(&response_);
        } else {
            this->Finish(status);
        }
    }

    const StreamLimit::Slot slot_;
    SerialExecutor* executor_;
    Fill fill_;
    Response response_;
};

}  // namespace relume::server
