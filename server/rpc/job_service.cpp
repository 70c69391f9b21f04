#include "server/rpc/job_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <utility>

#include "core/base/error.h"
#include "proto/codec/codec.h"
#include "server/rpc/deferred.h"
#include "server/rpc/job_watcher.h"

namespace relume::server {
namespace {

constexpr std::size_t kPiece = codec::kMaxChunk / 2;  // leaves room for the message's other fields
constexpr int kDefaultPage = 50, kMaxPage = 1000;
constexpr std::size_t kMaxRequestId = 128;

// Tokens are the number of the last job sent.
std::uint64_t ParseToken(const std::string& token) {
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), number);
    if (!token.empty() &&
        (error != std::errc() || end != token.data() + token.size() || number == 0)) {
        ThrowInvalidArgument(fmt::format("'{:.40}' is no page token of this server", token));
    }
    return number;
}

}  // namespace

grpc::ServerUnaryReactor* JobService::CreateJob(grpc::CallbackServerContext* context,
                                                const v1::CreateJobRequest* request,
                                                v1::CreateJobResponse* response) {
    if (auto* refused = access_->Refuse<grpc::ServerUnaryReactor>(context, {Role::kClient})) {
        return refused;
    }
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    // Checked on the io thread, which looks for the blobs; made on the control thread.
    coordinator_->io().Post([this, context, reactor, request, response] {
        auto spec = std::make_shared<CheckedSpec>();
        const grpc::Status status = Guard([&] {
            if (request->request_id().size() > kMaxRequestId) {
                ThrowInvalidArgument(
                    fmt::format("request_id is longer than {} bytes; use a UUID", kMaxRequestId));
            }
            v1::JobSpec asked = request->spec();
            asked.set_owner(OwnerOf(*context, asked.owner()));
            *spec = CheckSpec(asked, coordinator_->blobs());
            spec->caller = OwnerOf(*context, "");
            coordinator_->CheckSize(*spec);
        });
        if (!status.ok() || request->validate_only()) {
            if (status.ok()) {
                *response->mutable_job()->mutable_spec() = spec->message;
                response->mutable_job()->set_samples_budget(spec->budgets.samples.value_or(0));
            }
            reactor->Finish(status);
            return;
        }
        coordinator_->control().Post([this, reactor, request, response, spec] {
            const auto name = std::make_shared<std::string>();
            const grpc::Status made = Guard([&] {
                *name = coordinator_->CreateJob(
                    request->request_id(), std::move(*spec),
                    [this, reactor, response, name](const std::optional<Error>& why) {
                        Answer(reactor, *name, why, response->mutable_job());
                    });
            });
            if (!made.ok()) {
                reactor->Finish(made);
            }
            coordinator_->Changed();
        });
    });
    return reactor;
}

grpc::ServerUnaryReactor* JobService::GetJob(grpc::CallbackServerContext* context,
                                             const v1::GetJobRequest* request,
                                             v1::GetJobResponse* response) {
    if (auto* refused = access_->Refuse<grpc::ServerUnaryReactor>(context, {Role::kClient})) {
        return refused;
    }
    return Deferred(context, &coordinator_->control(), [this, request, response] {
        coordinator_->FillJob(coordinator_->queue().Get(request->name()), true,
                              response->mutable_job());
    });
}

grpc::ServerUnaryReactor* JobService::ListJobs(grpc::CallbackServerContext* context,
                                               const v1::ListJobsRequest* request,
                                               v1::ListJobsResponse* response) {
    if (auto* refused = access_->Refuse<grpc::ServerUnaryReactor>(context, {Role::kClient})) {
        return refused;
    }
    return Deferred(context, &coordinator_->control(), [this, request, response] {
        if (request->page_size() < 0) {
            ThrowInvalidArgument(fmt::format("page size {} is negative", request->page_size()));
        }
        const int size =
            request->page_size() == 0 ? kDefaultPage : std::min(request->page_size(), kMaxPage);
        const auto limit = static_cast<std::size_t>(size);
        // One more than is sent tells whether there is a next page.
        const auto in_group = [&](const std::string& name) {
            return request->group().empty() ||
                   coordinator_->SpecOf(name).message.group() == request->group();
        };
        const auto jobs =
            coordinator_->queue().List(ParseToken(request->page_token()), limit + 1, in_group);
        for (std::size_t i = 0; i < std::min(limit, jobs.size()); ++i) {
            coordinator_->FillJob(*jobs[i], false, response->add_jobs());
        }
        if (jobs.size() > limit) {
            response->set_next_page_token(std::to_string(jobs[limit - 1]->number));
        }
    });
}

grpc::ServerUnaryReactor* JobService::CancelJob(grpc::CallbackServerContext* context,
                                                const v1::CancelJobRequest* request,
                                                v1::CancelJobResponse* response) {
    if (auto* refused = access_->Refuse<grpc::ServerUnaryReactor>(context, {Role::kClient})) {
        return refused;
    }
    return Later(context, request->name(), response->mutable_job(),
                 [this, request](Coordinator::Done done) {
                     coordinator_->CancelJob(request->name(), request->discard(), std::move(done));
                 });
}

grpc::ServerUnaryReactor* JobService::PauseJob(grpc::CallbackServerContext* context,
                                               const v1::PauseJobRequest* request,
                                               v1::PauseJobResponse* response) {
    if (auto* refused = access_->Refuse<grpc::ServerUnaryReactor>(context, {Role::kClient})) {
        return refused;
    }
    return Later(context, request->name(), response->mutable_job(),
                 [this, request](Coordinator::Done done) {
                     coordinator_->PauseJob(request->name(), std::move(done));
                 });
}

grpc::ServerUnaryReactor* JobService::ResumeJob(grpc::CallbackServerContext* context,
                                                const v1::ResumeJobRequest* request,
                                                v1::ResumeJobResponse* response) {
    if (auto* refused = access_->Refuse<grpc::ServerUnaryReactor>(context, {Role::kClient})) {
        return refused;
    }
    return Later(context, request->name(), response->mutable_job(),
                 [this, request](Coordinator::Done done) {
                     coordinator_->ResumeJob(request->name(), std::move(done));
                 });
}

grpc::ServerUnaryReactor* JobService::UpdateJob(grpc::CallbackServerContext* context,
                                                const v1::UpdateJobRequest* request,
                                                v1::UpdateJobResponse* response) {
    if (auto* refused = access_->Refuse<grpc::ServerUnaryReactor>(context, {Role::kClient})) {
        return refused;
    }
    return Later(
        context, request->name(), response->mutable_job(), [this, request](Coordinator::Done done) {
            coordinator_->UpdateJob(
                request->name(),
                request->has_priority() ? std::optional(request->priority()) : std::nullopt,
                std::move(done));
        });
}

grpc::ServerUnaryReactor* JobService::ExtendJob(grpc::CallbackServerContext* context,
                                                const v1::ExtendJobRequest* request,
                                                v1::ExtendJobResponse* response) {
    if (auto* refused = access_->Refuse<grpc::ServerUnaryReactor>(context, {Role::kClient})) {
        return refused;
    }
    return Later(context, request->name(), response->mutable_job(),
                 [this, request](Coordinator::Done done) {
                     coordinator_->ExtendJob(request->name(), request->spp(), std::move(done));
                 });
}

// A call that changes a job, which `begin` begins on the control thread, and that is answered when
// it is done.
grpc::ServerUnaryReactor* JobService::Later(grpc::CallbackServerContext* context,
                                            const std::string& name, v1::Job* job,
                                            const std::function<void(Coordinator::Done)>& begin) {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    coordinator_->control().Post([this, context, reactor, name, job, begin] {
        const grpc::Status status = Guard([&] {
            coordinator_->queue().Get(name);  // throws if there is none
            access_->CheckOwner(*context, name, coordinator_->SpecOf(name).message.owner());
            begin([this, reactor, name, job](const std::optional<Error>& why) {
                Answer(reactor, name, why, job);
            });
        });
        if (!status.ok()) {
            reactor->Finish(status);
        }
        coordinator_->Changed();
    });
    return reactor;
}

void JobService::Answer(grpc::ServerUnaryReactor* reactor, const std::string& name,
                        const std::optional<Error>& why, v1::Job* job) {
    reactor->Finish(Guard([&] {
        if (why) {
            throw *why;
        }
        coordinator_->FillJob(coordinator_->queue().Get(name), true, job);
    }));
}

grpc::ServerWriteReactor<v1::WatchJobResponse>* JobService::WatchJob(
    grpc::CallbackServerContext* context, const v1::WatchJobRequest* request) {
    if (auto* refused = access_->Refuse<grpc::ServerWriteReactor<v1::WatchJobResponse>>(
            context, {Role::kClient})) {
        return refused;
    }
    StreamLimit::Slot slot;
    if (auto* refused =
            access_->RefuseStream<grpc::ServerWriteReactor<v1::WatchJobResponse>>(context, &slot)) {
        return refused;
    }
    return JobWatcher::Start(coordinator_, request->name(), request->from_event(), std::move(slot));
}

grpc::ServerWriteReactor<v1::FetchResultResponse>* JobService::FetchResult(
    grpc::CallbackServerContext* context, const v1::FetchResultRequest* request) {
    if (auto* refused = access_->Refuse<grpc::ServerWriteReactor<v1::FetchResultResponse>>(
            context, {Role::kClient})) {
        return refused;
    }
    StreamLimit::Slot slot;
    if (auto* refused = access_->RefuseStream<grpc::ServerWriteReactor<v1::FetchResultResponse>>(
            context, &slot)) {
        return refused;
    }
    const auto file = std::make_shared<Coordinator::ResultFile>();
    const auto prepare = [this, file, name = request->name(), offset = request->offset()] {
        *file = coordinator_->ResultOf(name);
        if (offset > file->size) {
            ThrowInvalidArgument(
                fmt::format("the result of {} has {} bytes, none at {}", name, file->size, offset));
        }
    };
    const auto fill = [this, file, offset = request->offset(),
                       first = true](v1::FetchResultResponse* response) mutable {
        response->set_offset(offset);
        response->set_size(file->size);
        response->set_sha256(file->sha256);
        response->set_data(coordinator_->results().Read(file->id, offset, kPiece));
        offset += response->data().size();
        coordinator_->traffic().results_out += response->data().size();
        // An empty end is sent only to say size and digest.
        return std::exchange(first, false) || !response->data().empty();
    };
    return new PieceStream<v1::FetchResultResponse>(std::move(slot), &coordinator_->control(),
                                                    prepare, &coordinator_->io(), fill);
}

grpc::ServerUnaryReactor* JobService::ListWorkers(grpc::CallbackServerContext* context,
                                                  const v1::ListWorkersRequest*,
                                                  v1::ListWorkersResponse* response) {
    if (auto* refused = access_->Refuse<grpc::ServerUnaryReactor>(context, {Role::kClient})) {
        return refused;
    }
    return Deferred(context, &coordinator_->control(), [this, response] {
        for (const auto& worker : coordinator_->queue().Workers(coordinator_->Now())) {
            WorkerToProto(worker, coordinator_->wall(), response->add_workers());
        }
    });
}

grpc::ServerUnaryReactor* JobService::ReleaseWorker(grpc::CallbackServerContext* context,
                                                    const v1::ReleaseWorkerRequest* request,
                                                    v1::ReleaseWorkerResponse*) {
    if (auto* refused = access_->Refuse<grpc::ServerUnaryReactor>(context, {Role::kOperator})) {
        return refused;
    }
    return Deferred(context, &coordinator_->control(), [this, request] {
        coordinator_->queue().Release(request->name());
        coordinator_->Changed();
    });
}

}  // namespace relume::server
