#include "server/rpc/blob_service.h"

#include <fmt/format.h>
#include <grpcpp/alarm.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <utility>

#include "core/base/error.h"
#include "proto/codec/codec.h"
#include "server/rpc/deferred.h"

namespace relume::server {
namespace {

constexpr std::size_t kPiece = codec::kMaxChunk / 2;  // leaves room for the message's other fields
constexpr int kMaxAsked = 100'000;

// A client that has begun an upload holds the blob, and room for it.
constexpr std::chrono::minutes kIdleTime{5};

// Ends a call of which nothing was heard for kIdleTime. Outlives it.
class IdleWatch : public std::enable_shared_from_this<IdleWatch> {
  public:
    explicit IdleWatch(grpc::CallbackServerContext* context) : context_(context) {}

    void Begin() {
        alarm_ = std::make_unique<grpc::Alarm>();
        alarm_->Set(std::chrono::system_clock::now() + kIdleTime,
                    [self = shared_from_this()](bool expired) {
                        const std::lock_guard lock(self->mutex_);
                        if (expired && self->context_ != nullptr) {
                            self->context_->TryCancel();
                        }
                    });
    }
    void End() { alarm_.reset(); }
    // The call is over.
    void Leave() {
        const std::lock_guard lock(mutex_);
        context_ = nullptr;
    }

  private:
    std::unique_ptr<grpc::Alarm> alarm_;
    std::mutex mutex_;
    grpc::CallbackServerContext* context_;  // guarded by mutex_
};

// One upload. A read and work on the io thread take turns, and each ends in the other or in Finish.
class BlobWriter final : public grpc::ServerReadReactor<v1::WriteBlobRequest> {
  public:
    BlobWriter(Coordinator* coordinator, grpc::CallbackServerContext* context,
               v1::WriteBlobResponse* response, StreamLimit::Slot slot)
        : coordinator_(coordinator),
          response_(response),
          slot_(std::move(slot)),
          idle_(std::make_shared<IdleWatch>(context)) {
        Read();
    }

    void OnReadDone(bool ok) override {
        coordinator_->io().Post([this, ok] {
            idle_->End();
            bool done = false;
            const grpc::Status status = Guard([&] { done = ok ? Take() : End(); });
            if (!status.ok() || done) {
                upload_.reset();  // before the client hears: it may come again at once
                Finish(status);
            } else {
                Read();
            }
        });
    }
    void OnDone() override {
        idle_->Leave();
        delete this;
    }

  private:
    void Read() {
        idle_->Begin();
        StartRead(&request_);
    }

    // True: the blob is complete.
    bool Take() {
        store::BlobStore& blobs = coordinator_->blobs();
        if (!upload_) {
            sha256_ = request_.sha256();
            if (blobs.Has(sha256_)) {
                response_->set_committed_size(blobs.SizeOf(sha256_));
                return true;
            }
            upload_ = blobs.Begin(sha256_, request_.size(), request_.offset());
        }
        if (request_.offset() != upload_->offset() || request_.data().size() > codec::kMaxChunk) {
            ThrowInvalidArgument(fmt::format(
                "blob {}: {} bytes for offset {} came; at most {} for {} are due", sha256_,
                request_.data().size(), request_.offset(), codec::kMaxChunk, upload_->offset()));
        }
        upload_->Append(request_.data());
        coordinator_->traffic().blobs_in += request_.data().size();
        if (!upload_->complete()) {
            return false;
        }
        upload_->Commit();
        response_->set_committed_size(upload_->offset());
        return true;
    }

    bool End() {
        ThrowInvalidArgument(fmt::format("the upload of blob {} ended at byte {}; go on there",
                                         sha256_, upload_ ? upload_->offset() : 0));
    }

    Coordinator* coordinator_;
    v1::WriteBlobResponse* response_;
    const StreamLimit::Slot slot_;
    const std::shared_ptr<IdleWatch> idle_;
    v1::WriteBlobRequest request_;
    std::string sha256_;
    std::unique_ptr<store::BlobStore::Upload> upload_;
};

}  // namespace

grpc::ServerUnaryReactor* BlobService::FindMissingBlobs(grpc::CallbackServerContext* context,
                                                        const v1::FindMissingBlobsRequest* request,
                                                        v1::FindMissingBlobsResponse* response) {
    if (auto* refused = access_->Refuse<grpc::ServerUnaryReactor>(context, {Role::kClient})) {
        return refused;
    }
    return Deferred(context, &coordinator_->io(), [this, request, response] {
        if (request->sha256_size() > kMaxAsked) {
            ThrowInvalidArgument(fmt::format("{} blobs in one question; ask for at most {}",
                                             request->sha256_size(), kMaxAsked));
        }
        for (const auto& sha256 : request->sha256()) {
            if (!coordinator_->blobs().Has(sha256)) {
                v1::MissingBlob* missing = response->add_missing();
                missing->set_sha256(sha256);
                missing->set_offset(coordinator_->blobs().PartSize(sha256));
            }
        }
    });
}

grpc::ServerReadReactor<v1::WriteBlobRequest>* BlobService::WriteBlob(
    grpc::CallbackServerContext* context, v1::WriteBlobResponse* response) {
    if (auto* refused = access_->Refuse<grpc::ServerReadReactor<v1::WriteBlobRequest>>(
            context, {Role::kClient})) {
        return refused;
    }
    StreamLimit::Slot slot;
    if (auto* refused =
            access_->RefuseStream<grpc::ServerReadReactor<v1::WriteBlobRequest>>(context, &slot)) {
        return refused;
    }
    return new BlobWriter(coordinator_, context, response, std::move(slot));
}

grpc::ServerWriteReactor<v1::ReadBlobResponse>* BlobService::ReadBlob(
    grpc::CallbackServerContext* context, const v1::ReadBlobRequest* request) {
    if (auto* refused = access_->Refuse<grpc::ServerWriteReactor<v1::ReadBlobResponse>>(
            context, {Role::kClient, Role::kWorker})) {
        return refused;
    }
    StreamLimit::Slot slot;
    if (auto* refused =
            access_->RefuseStream<grpc::ServerWriteReactor<v1::ReadBlobResponse>>(context, &slot)) {
        return refused;
    }
    const auto fill = [this, sha256 = request->sha256(), offset = request->offset(),
                       first = true](v1::ReadBlobResponse* response) mutable {
        const store::BlobStore& blobs = coordinator_->blobs();
        const std::uint64_t size = blobs.SizeOf(sha256);
        if (offset > size) {
            ThrowInvalidArgument(
                fmt::format("blob {} has {} bytes, none at {}", sha256, size, offset));
        }
        response->set_offset(offset);
        response->set_size(size);
        response->set_data(blobs.Read(sha256, offset, kPiece));
        offset += response->data().size();
        coordinator_->traffic().blobs_out += response->data().size();
        // An empty end is sent only to say the size.
        return std::exchange(first, false) || !response->data().empty();
    };
    return new PieceStream<v1::ReadBlobResponse>(std::move(slot), &coordinator_->io(), fill);
}

}  // namespace relume::server
