#include "worker/loop/blob_fetch.h"

#include <fmt/format.h>
#include <grpcpp/client_context.h>

#include <chrono>

#include "core/base/error.h"
#include "proto/codec/status.h"
#include "relume/v1/blobs.grpc.pb.h"

namespace relume::worker {
namespace {

// One blob in one go; what is larger or slower goes on where it was in the next attempt.
constexpr std::chrono::minutes kReadDeadline{5};

}  // namespace

BlobFetch MakeBlobFetch(const std::shared_ptr<grpc::Channel>& channel, const std::string& server,
                        const CancelToken* cancel) {
    const std::shared_ptr<v1::BlobService::Stub> stub = v1::BlobService::NewStub(channel);
    return [stub, server, cancel](const std::string& sha256, std::uint64_t offset,
                                  const std::function<void(const std::string&)>& sink) {
        grpc::ClientContext context;
        context.set_deadline(std::chrono::system_clock::now() + kReadDeadline);
        v1::ReadBlobRequest request;
        request.set_sha256(sha256);
        request.set_offset(offset);
        const auto reader = stub->ReadBlob(&context, request);
        v1::ReadBlobResponse response;
        try {
            while (reader->Read(&response)) {
                if (cancel->cancelled()) {
                    throw Error(ErrorCode::kCancelled, "the worker stops");
                }
                if (response.offset() != offset) {
                    throw Error(ErrorCode::kUnavailable,
                                fmt::format("blob {}: the server sent offset {} instead of {}",
                                            sha256, response.offset(), offset));
                }
                sink(response.data());
                offset += response.data().size();
            }
        } catch (...) {
            context.TryCancel();
            reader->Finish();
            throw;
        }
        if (const grpc::Status status = reader->Finish(); !status.ok()) {
            throw codec::FromStatus(status, server);
        }
    };
}

}  // namespace relume::worker
