#include "worker/loop/work_stream.h"

#include <utility>

#include "core/trust/join_token.h"

namespace relume::worker {

std::shared_ptr<WorkStream> WorkStream::Open(v1::WorkerService::Stub* stub,
                                             const std::string& join_token, Handler handler) {
    std::shared_ptr<WorkStream> stream(new WorkStream(std::move(handler)));
    stream->self_ = stream;
    if (!join_token.empty()) {
        stream->context_.AddMetadata(kJoinTokenKey, join_token);
    }
    stub->async()->Work(&stream->context_, stream.get());
    stream->AddHold();
    stream->StartRead(&stream->incoming_);
    stream->StartCall();
    return stream;
}

void WorkStream::Send(v1::WorkRequest message) {
    std::unique_lock lock(mutex_);
    if (broken_ || finishing_) {
        return;
    }
    outbox_.push_back(std::move(message));
    Advance(std::move(lock));
}

void WorkStream::Finish() {
    std::unique_lock lock(mutex_);
    finishing_ = true;
    Advance(std::move(lock));
}

void WorkStream::OnReadDone(bool ok) {
    if (ok) {
        handler_.on_message(std::move(incoming_));
        incoming_.Clear();
        StartRead(&incoming_);
        return;
    }
    std::unique_lock lock(mutex_);
    broken_ = true;
    outbox_.clear();
    Advance(std::move(lock));
}

void WorkStream::OnWriteDone(bool ok) {
    std::unique_lock lock(mutex_);
    writing_ = false;
    if (!ok) {
        broken_ = true;
        outbox_.clear();
    }
    Advance(std::move(lock));
}

void WorkStream::Advance(std::unique_lock<std::mutex> lock) {
    if (writing_ || ended_) {
        return;
    }
    if (!outbox_.empty()) {
        outgoing_ = std::move(outbox_.front());
        outbox_.pop_front();
        writing_ = true;
        lock.unlock();
        StartWrite(&outgoing_);
        return;
    }
    if (broken_ || finishing_) {
        ended_ = true;
        const bool half_close = !broken_;
        lock.unlock();
        if (half_close) {
            StartWritesDone();
        }
        RemoveHold();
    }
}

bool WorkStream::WaitUntilClosed(std::chrono::milliseconds limit) {
    std::unique_lock lock(mutex_);
    return closing_.wait_for(lock, limit, [this] { return closed_; });
}

void WorkStream::OnDone(const grpc::Status& status) {
    {
        const std::lock_guard lock(mutex_);
        closed_ = true;
        closing_.notify_all();
    }
    // Whoever hears of the end may drop the channel. The last reference to one must not fall on a
    // thread of gRPC, which would wait for itself: so the stream, whose context holds one, is let
    // go before.
    const auto on_closed = std::move(handler_.on_closed);
    std::exchange(self_, nullptr).reset();
    on_closed(status);
}

}  // namespace relume::worker
