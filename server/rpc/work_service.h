#pragma once

#include "relume/v1/work.grpc.pb.h"
#include "server/rpc/access.h"
#include "server/rpc/coordinator.h"

namespace relume::server {

// The workers' streams.
class WorkService final : public v1::WorkerService::CallbackService {
  public:
    // Both outlive the service.
    WorkService(Coordinator* coordinator, const Access* access)
        : coordinator_(coordinator), access_(access) {}

    grpc::ServerBidiReactor<v1::WorkRequest, v1::WorkResponse>* Work(
        grpc::CallbackServerContext* context) override;

  private:
    Coordinator* coordinator_;
    const Access* access_;
};

}  // namespace relume::server
