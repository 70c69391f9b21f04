#include "client/lib/client.h"

#include <fmt/format.h>
#include <grpcpp/create_channel.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <random>
#include <utility>

#include "client/lib/client_calls.h"
#include "client/lib/job_names.h"
#include "core/base/error.h"
#include "proto/channel/credentials.h"
#include "proto/codec/codec.h"

namespace relume::client {
namespace {

constexpr int kConnectMilliseconds = 4000;

}  // namespace

Client::Client(const Endpoint& server) : server_(server) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 20'000);
    arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
    arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
    // Also the time that an attempt to connect may take.
    arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kConnectMilliseconds);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2'000);
    channel_ = grpc::CreateCustomChannel(server_.address, channel::MakeCredentials(server_.tls),
                                         arguments);
    jobs_ = v1::JobService::NewStub(channel_);
    blobs_ = v1::BlobService::NewStub(channel_);
}

void Client::Interrupt() {
    interrupted_ = true;
    const std::lock_guard lock(mutex_);
    if (current_ != nullptr) {
        current_->TryCancel();
    }
}

void Client::Throw(const grpc::Status& status) const {
    if (interrupted_) {
        throw Error(ErrorCode::kCancelled, "interrupted");
    }
    throw channel::ExplainStatus(status, server_.address, server_.tls);
}

void Client::Require(const grpc::Status& status) {
    if (!status.ok()) {
        Throw(status);
    }
    reached_ = true;
}

void Client::Insist(const std::function<grpc::Status(grpc::ClientContext*)>& call) {
    for (Retry retry(this);;) {
        CallContext context(this, kUnarySeconds);
        const grpc::Status status = call(context.get());
        if (status.ok()) {
            reached_ = true;
            return;
        }
        retry.Wait(status);
    }
}

void Client::Validate(const v1::JobSpec& spec) {
    v1::CreateJobRequest request;
    *request.mutable_spec() = spec;
    request.set_validate_only(true);
    CallContext context(this, kUnarySeconds);
    v1::CreateJobResponse response;
    const auto status = jobs_->CreateJob(context.get(), request, &response);
    if (status.error_code() != grpc::StatusCode::FAILED_PRECONDITION &&
        status.error_code() != grpc::StatusCode::NOT_FOUND) {
        Require(status);
    }
    reached_ = true;
}

v1::Job Client::Create(const v1::JobSpec& spec) {
    v1::CreateJobRequest request;
    request.set_request_id(MakeRequestId());
    *request.mutable_spec() = spec;
    for (Retry retry(this);;) {
        CallContext context(this, kUnarySeconds);
        v1::CreateJobResponse response;
        const auto status = jobs_->CreateJob(context.get(), request, &response);
        if (status.ok()) {
            reached_ = true;
            v1::JobSpec asked = spec;
            asked.set_owner(response.job().spec().owner());  // which the server knows better
            if (response.job().spec().SerializeAsString() != asked.SerializeAsString()) {
                Cancel(response.job().name(), true);
                throw Error(ErrorCode::kDataLoss,
                            fmt::format("{}: {} is another job than was asked for: bits changed on "
                                        "the way; it is cancelled, try again",
                                        server_.address, response.job().name()));
            }
            return response.job();
        }
        retry.Wait(status);
    }
}

v1::Job Client::Get(const std::string& name) {
    v1::GetJobRequest request;
    request.set_name(JobName(name));
    v1::GetJobResponse response;
    Insist(
        [&](grpc::ClientContext* context) { return jobs_->GetJob(context, request, &response); });
    return response.job();
}

v1::Job Client::Cancel(const std::string& name, bool discard) {
    v1::CancelJobRequest request;
    request.set_name(JobName(name));
    request.set_discard(discard);
    v1::CancelJobResponse response;
    CallContext context(this, kUnarySeconds);
    Require(jobs_->CancelJob(context.get(), request, &response));
    return response.job();
}

v1::Job Client::Pause(const std::string& name) {
    v1::PauseJobRequest request;
    request.set_name(JobName(name));
    v1::PauseJobResponse response;
    CallContext context(this, kUnarySeconds);
    Require(jobs_->PauseJob(context.get(), request, &response));
    return response.job();
}

v1::Job Client::Continue(const std::string& name) {
    v1::ResumeJobRequest request;
    request.set_name(JobName(name));
    v1::ResumeJobResponse response;
    CallContext context(this, kUnarySeconds);
    Require(jobs_->ResumeJob(context.get(), request, &response));
    return response.job();
}

v1::Job Client::SetPriority(const std::string& name, int priority) {
    v1::UpdateJobRequest request;
    request.set_name(JobName(name));
    request.set_priority(priority);
    v1::UpdateJobResponse response;
    CallContext context(this, kUnarySeconds);
    Require(jobs_->UpdateJob(context.get(), request, &response));
    return response.job();
}

v1::Job Client::Extend(const std::string& name, double spp) {
    v1::ExtendJobRequest request;
    request.set_name(JobName(name));
    request.set_spp(spp);
    v1::ExtendJobResponse response;
    CallContext context(this, kUnarySeconds);
    Require(jobs_->ExtendJob(context.get(), request, &response));
    return response.job();
}

std::vector<v1::Job> Client::List(std::size_t limit, const std::string& group) {
    std::vector<v1::Job> jobs;
    v1::ListJobsRequest request;
    request.set_group(group);
    do {
        request.set_page_size(static_cast<int>(std::min<std::size_t>(limit - jobs.size(), 1000)));
        v1::ListJobsResponse response;
        CallContext context(this, kUnarySeconds);
        Require(jobs_->ListJobs(context.get(), request, &response));
        // A server that does not know of groups lists all jobs.
        std::copy_if(
            response.jobs().begin(), response.jobs().end(), std::back_inserter(jobs),
            [&](const v1::Job& job) { return group.empty() || job.spec().group() == group; });
        request.set_page_token(response.next_page_token());
    } while (!request.page_token().empty() && jobs.size() < limit);
    return jobs;
}

void Client::Release(const std::string& worker) {
    v1::ReleaseWorkerRequest request;
    request.set_name(worker);
    v1::ReleaseWorkerResponse response;
    CallContext context(this, kUnarySeconds);
    Require(jobs_->ReleaseWorker(context.get(), request, &response));
}

std::vector<v1::Worker> Client::Workers() {
    v1::ListWorkersResponse response;
    CallContext context(this, kUnarySeconds);
    Require(jobs_->ListWorkers(context.get(), v1::ListWorkersRequest(), &response));
    return {response.workers().begin(), response.workers().end()};
}

v1::Job Client::Watch(const std::string& name,
                      const std::function<void(const v1::Job&)>& on_event) {
    v1::WatchJobRequest request;
    request.set_name(JobName(name));
    v1::Job job;
    for (Retry retry(this, kWatchPatienceSeconds);;) {
        CallContext context(this, 0);
        const auto reader = jobs_->WatchJob(context.get(), request);
        v1::WatchJobResponse response;
        while (reader->Read(&response)) {
            retry.Progress();
            request.set_from_event(response.event() + 1);
            job = response.job();
            on_event(job);
        }
        const auto status = reader->Finish();
        if (IsOver(job.state())) {
            return job;
        }
        retry.Wait(status.ok()
                       ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "the server closed the stream")
                       : status);
    }
}

}  // namespace relume::client
