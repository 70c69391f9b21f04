#pragma once

#include "relume/v1/work.grpc.pb.h"
#include "server/rpc/coordinator.h"

namespace relume::server {

// The workers' streams.
class WorkService final : public v1::WorkerService::CallbackService {
  public:
    explicit WorkService(Coordinator* coordinator) : coordinator_(coordinator) {}

    grpc::ServerBidiReactor<v1::WorkRequest, v1::WorkResponse>* Work(
        grpc::CallbackServerContext* context) override;

  private:
    Coordinator* coordinator_;
};

}  // namespace relume::server
