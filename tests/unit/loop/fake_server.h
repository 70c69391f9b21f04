#pragma once

#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "core/base/sha256.h"
#include "proto/codec/codec.h"
#include "relume/v1/blobs.grpc.pb.h"
#include "relume/v1/work.grpc.pb.h"

namespace relume::worker {

// A server of one worker whose every word is the test's: what the worker says is queued, what it is
// told comes from Send.
class FakeServer final : public v1::WorkerService::Service, public v1::BlobService::Service {
  public:
    FakeServer() {
        grpc::ServerBuilder builder;
        builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
        builder.RegisterService(static_cast<v1::WorkerService::Service*>(this));
        builder.RegisterService(static_cast<v1::BlobService::Service*>(this));
        server_ = builder.BuildAndStart();
    }
    ~FakeServer() override { server_->Shutdown(std::chrono::system_clock::now()); }

    std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
    std::string AddBlob(const std::string& bytes) {
        const std::string sha256 = Sha256Hex(bytes);
        blobs_[sha256] = bytes;
        return sha256;
    }
    // The next Hello is answered with this instead of a Welcome.
    void RefuseWith(const grpc::Status& status) {
        const std::lock_guard lock(mutex_);
        refusal_ = status;
    }

    // The next message of the worker; Reports only if wanted. Waits for it.
    v1::WorkRequest Next(bool reports = false) {
        std::unique_lock lock(mutex_);
        for (;;) {
            changed_.wait(lock, [this] { return !inbox_.empty(); });
            v1::WorkRequest message = std::move(inbox_.front());
            inbox_.pop_front();
            if (reports || !message.has_report()) {
                return message;
            }
        }
    }
    void Send(const v1::WorkResponse& message) {
        const std::lock_guard lock(mutex_);
        stream_->Write(message);
    }
    // Cuts the stream.
    void Break() {
        const std::lock_guard lock(mutex_);
        context_->TryCancel();
    }
    // Waits until the worker has closed its stream.
    void WaitForGoodbye() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return goodbye_ && stream_ == nullptr; });
    }

    grpc::Status Work(
        grpc::ServerContext* context,
        grpc::ServerReaderWriter<v1::WorkResponse, v1::WorkRequest>* stream) override {
        {
            const std::lock_guard lock(mutex_);
            stream_ = stream;
            context_ = context;
            goodbye_ = false;
        }
        grpc::Status status;
        v1::WorkRequest message;
        while (stream->Read(&message)) {
            const std::lock_guard lock(mutex_);
            if (message.has_hello() && refusal_) {
                status = *std::exchange(refusal_, std::nullopt);
                break;
            }
            if (message.has_hello()) {
                v1::WorkResponse response;
                response.mutable_welcome()->set_name(message.hello().name());
                response.mutable_welcome()->set_report_seconds(0.05);
                stream->Write(response);
            }
            inbox_.push_back(std::move(message));
            changed_.notify_all();
        }
        const std::lock_guard lock(mutex_);
        stream_ = nullptr;
        goodbye_ = !context->IsCancelled();
        changed_.notify_all();
        return status;
    }

    grpc::Status ReadBlob(grpc::ServerContext*, const v1::ReadBlobRequest* request,
                          grpc::ServerWriter<v1::ReadBlobResponse>* writer) override {
        const auto it = blobs_.find(request->sha256());
        if (it == blobs_.end()) {
            return {grpc::StatusCode::NOT_FOUND, "blob is not here"};
        }
        v1::ReadBlobResponse response;
        response.set_offset(request->offset());
        response.set_data(it->second.substr(request->offset()));
        response.set_size(it->second.size());
        writer->Write(response);
        return grpc::Status::OK;
    }

  private:
    int port_ = 0;
    std::map<std::string, std::string> blobs_;  // filled before workers come
    std::unique_ptr<grpc::Server> server_;

    std::mutex mutex_;  // guards all below
    std::condition_variable changed_;
    std::deque<v1::WorkRequest> inbox_;
    grpc::ServerReaderWriter<v1::WorkResponse, v1::WorkRequest>* stream_ = nullptr;
    grpc::ServerContext* context_ = nullptr;
    std::optional<grpc::Status> refusal_;
    bool goodbye_ = false;
};

}  // namespace relume::worker
