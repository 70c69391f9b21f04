#pragma once

#include <memory>
#include <string>

#include "proto/codec/protocol.h"
#include "relume/v1/work.grpc.pb.h"

namespace relume::server {

// A worker's end of a stream by hand: it has said Hello, and no more.
class WorkerHand {
  public:
    explicit WorkerHand(v1::WorkerService::Stub* stub, const std::string& name = "hand")
        : stream_(stub->Work(&context_)) {
        v1::WorkRequest hello;
        hello.mutable_hello()->set_name(name);
        hello.mutable_hello()->set_protocol_version(kProtocolVersion);
        hello.mutable_hello()->mutable_numeric_class()->set_build(kBuild);
        hello.mutable_hello()->mutable_numeric_class()->set_isa("avx2");
        hello.mutable_hello()->set_threads(1);
        stream_->Write(hello);
    }
    ~WorkerHand() { End(); }

    // Waits for the server's first answer.
    bool IsWelcome() {
        v1::WorkResponse message;
        return stream_->Read(&message) && message.has_welcome();
    }
    void Want(std::uint32_t leases) {
        v1::WorkRequest report;
        report.mutable_report()->set_credits(leases);
        stream_->Write(report);
    }
    // The next lease; an empty one at the stream's end.
    v1::Lease TakeLease() {
        v1::WorkResponse message;
        while (stream_->Read(&message)) {
            if (message.has_job()) {
                context = message.job();
            }
            if (message.has_lease()) {
                return message.lease();
            }
        }
        return {};
    }
    bool Send(const v1::WorkRequest& message) { return stream_->Write(message); }
    // Reads to the stream's end, which the server makes.
    grpc::Status WaitForEnd() {
        TakeAll();
        ended_ = true;
        return stream_->Finish();
    }
    void End() {
        if (!ended_) {
            ended_ = true;
            context_.TryCancel();
            stream_->Finish();
        }
    }

    v1::JobContext context;  // the last one that came

  private:
    void TakeAll() {
        v1::WorkResponse message;
        while (stream_->Read(&message)) {
        }
    }

    grpc::ClientContext context_;
    std::unique_ptr<grpc::ClientReaderWriter<v1::WorkRequest, v1::WorkResponse>> stream_;
    bool ended_ = false;
};

}  // namespace relume::server
