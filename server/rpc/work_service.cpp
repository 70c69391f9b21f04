#include "server/rpc/work_service.h"

#include <utility>

#include "server/rpc/work_session.h"

namespace relume::server {

grpc::ServerBidiReactor<v1::WorkRequest, v1::WorkResponse>* WorkService::Work(
    grpc::CallbackServerContext* context) {
    using Reactor = grpc::ServerBidiReactor<v1::WorkRequest, v1::WorkResponse>;
    if (auto* refused = access_->RefuseWorker<Reactor>(context)) {
        return refused;
    }
    StreamLimit::Slot slot;
    if (auto* refused = access_->RefuseStream<Reactor>(context, &slot)) {
        return refused;
    }
    return WorkSession::Start(coordinator_, std::move(slot));
}

}  // namespace relume::server
