#pragma once

#include "relume/v1/blobs.grpc.pb.h"
#include "server/rpc/access.h"
#include "server/rpc/coordinator.h"

namespace relume::server {

// Blobs up and down. All disk work is on the io thread.
class BlobService final : public v1::BlobService::CallbackService {
  public:
    // Both outlive the service.
    BlobService(Coordinator* coordinator, const Access* access)
        : coordinator_(coordinator), access_(access) {}

    grpc::ServerUnaryReactor* FindMissingBlobs(grpc::CallbackServerContext* context,
                                               const v1::FindMissingBlobsRequest* request,
                                               v1::FindMissingBlobsResponse* response) override;
    grpc::ServerReadReactor<v1::WriteBlobRequest>* WriteBlob(
        grpc::CallbackServerContext* context, v1::WriteBlobResponse* response) override;
    grpc::ServerWriteReactor<v1::ReadBlobResponse>* ReadBlob(
        grpc::CallbackServerContext* context, const v1::ReadBlobRequest* request) override;

  private:
    Coordinator* coordinator_;
    const Access* access_;
};

}  // namespace relume::server
