#pragma once

#include <functional>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "relume/v1/jobs.grpc.pb.h"
#include "server/rpc/access.h"
#include "server/rpc/coordinator.h"

namespace relume::server {

// Jobs for clients.
class JobService final : public v1::JobService::CallbackService {
  public:
    // Both outlive the service.
    JobService(Coordinator* coordinator, const Access* access)
        : coordinator_(coordinator), access_(access) {}

    grpc::ServerUnaryReactor* CreateJob(grpc::CallbackServerContext* context,
                                        const v1::CreateJobRequest* request,
                                        v1::CreateJobResponse* response) override;
    grpc::ServerUnaryReactor* GetJob(grpc::CallbackServerContext* context,
                                     const v1::GetJobRequest* request,
                                     v1::GetJobResponse* response) override;
    grpc::ServerUnaryReactor* ListJobs(grpc::CallbackServerContext* context,
                                       const v1::ListJobsRequest* request,
                                       v1::ListJobsResponse* response) override;
    grpc::ServerUnaryReactor* CancelJob(grpc::CallbackServerContext* context,
                                        const v1::CancelJobRequest* request,
                                        v1::CancelJobResponse* response) override;
    grpc::ServerUnaryReactor* PauseJob(grpc::CallbackServerContext* context,
                                       const v1::PauseJobRequest* request,
                                       v1::PauseJobResponse* response) override;
    grpc::ServerUnaryReactor* ResumeJob(grpc::CallbackServerContext* context,
                                        const v1::ResumeJobRequest* request,
                                        v1::ResumeJobResponse* response) override;
    grpc::ServerUnaryReactor* UpdateJob(grpc::CallbackServerContext* context,
                                        const v1::UpdateJobRequest* request,
                                        v1::UpdateJobResponse* response) override;
    grpc::ServerUnaryReactor* ExtendJob(grpc::CallbackServerContext* context,
                                        const v1::ExtendJobRequest* request,
                                        v1::ExtendJobResponse* response) override;
    grpc::ServerWriteReactor<v1::WatchJobResponse>* WatchJob(
        grpc::CallbackServerContext* context, const v1::WatchJobRequest* request) override;
    grpc::ServerWriteReactor<v1::FetchResultResponse>* FetchResult(
        grpc::CallbackServerContext* context, const v1::FetchResultRequest* request) override;
    grpc::ServerUnaryReactor* ListWorkers(grpc::CallbackServerContext* context,
                                          const v1::ListWorkersRequest* request,
                                          v1::ListWorkersResponse* response) override;
    grpc::ServerUnaryReactor* ReleaseWorker(grpc::CallbackServerContext* context,
                                            const v1::ReleaseWorkerRequest* request,
                                            v1::ReleaseWorkerResponse* response) override;

  private:
    grpc::ServerUnaryReactor* Later(grpc::CallbackServerContext* context, const std::string& name,
                                    v1::Job* job,
                                    const std::function<void(Coordinator::Done)>& begin);
    void Answer(grpc::ServerUnaryReactor* reactor, const std::string& name,
                const std::optional<Error>& why, v1::Job* job);

    Coordinator* coordinator_;
    const Access* access_;
};

}  // namespace relume::server
