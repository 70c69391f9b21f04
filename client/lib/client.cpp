#include "client/lib/client.h"

#include <fmt/format.h>
#include <grpcpp/create_channel.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <random>
#include <thread>
#include <utility>

#include "client/lib/job_names.h"
#include "core/base/error.h"
#include "core/base/sha256.h"
#include "proto/channel/credentials.h"
#include "proto/codec/codec.h"

namespace relume::client {
namespace {

constexpr int kConnectMilliseconds = 4000;
constexpr double kUnarySeconds = 20;
constexpr double kChunkSeconds = 600;  // one blob, one result

// Of a call that came to nothing because its connection did. The second is what a server that stops
// says to what comes in at its last moment, the third what gRPC says of a connection that broke by
// bytes that are not what TLS makes of them.
bool MayPass(const grpc::Status& status) {
    return status.error_code() == grpc::StatusCode::UNAVAILABLE ||
           status.error_code() == grpc::StatusCode::CANCELLED ||
           (status.error_code() == grpc::StatusCode::UNKNOWN &&
            status.error_message() == "Stream removed");
}

}  // namespace

// A call's context, known to Interrupt while it lives.
class Client::CallContext {
  public:
    // `seconds` 0: no deadline.
    CallContext(Client* client, double seconds) : client_(client) {
        if (seconds > 0) {
            context_.set_deadline(std::chrono::system_clock::now() +
                                  std::chrono::milliseconds(static_cast<int>(seconds * 1000)));
        }
        const std::lock_guard lock(client_->mutex_);
        client_->current_ = &context_;
        if (client_->interrupted_) {
            context_.TryCancel();
        }
    }
    ~CallContext() {
        const std::lock_guard lock(client_->mutex_);
        client_->current_ = nullptr;
    }
    CallContext(const CallContext&) = delete;
    CallContext& operator=(const CallContext&) = delete;

    grpc::ClientContext* get() { return &context_; }

  private:
    Client* client_;
    grpc::ClientContext context_;
};

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

// How long and how often a call that the server may not have got is tried again.
class Client::Retry {
  public:
    explicit Retry(Client* client, double patience = kPatienceSeconds)
        : client_(client), patience_(patience) {}

    // The call gets on: patience starts anew.
    void Progress() {
        client_->reached_ = true;
        since_ = std::chrono::steady_clock::now();
        backoff_ = kFirstBackoff;
    }

    // Waits before the next attempt of a call that failed with `status`; throws if it is not worth
    // one.
    void Wait(const grpc::Status& status) {
        using Seconds = std::chrono::duration<double>;
        const double patience = client_->reached_ ? patience_ : kFirstContactSeconds;
        if (client_->interrupted_ || !MayPass(status) ||
            Seconds(std::chrono::steady_clock::now() - since_).count() >= patience) {
            client_->Throw(status);
        }
        static thread_local std::mt19937 random(std::random_device{}());
        Pause(Seconds(backoff_ * std::uniform_real_distribution<>(0.5, 1.5)(random)));
        backoff_ = std::min(2 * backoff_, 2.0);
    }

  private:
    static constexpr double kFirstBackoff = 0.1;                  // seconds
    static constexpr auto kStep = std::chrono::milliseconds(50);  // between looks at interrupted_

    // A connection comes about only while one of our threads waits on its channel: one that slept
    // between its calls, which fail at once, would never see TLS's handshake end.
    void Pause(std::chrono::duration<double> length) {
        using Clock = std::chrono::steady_clock;
        const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(length);
        while (!client_->interrupted_ && Clock::now() < end) {
            const auto step = std::min<Clock::duration>(kStep, end - Clock::now());
            if (client_->channel_->WaitForConnected(std::chrono::system_clock::now() + step)) {
                std::this_thread::sleep_for(step);  // it is the server that asks for patience
            }
        }
    }

    Client* client_;
    const double patience_;
    std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();
    double backoff_ = kFirstBackoff;
};

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

void Client::UploadScene(const LocalScene& scene,
                         const std::function<void(std::uint64_t, std::uint64_t)>& progress) {
    // Which blobs lack, and how much of each.
    std::map<std::string, const ManifestEntry*> entries;
    v1::FindMissingBlobsRequest request;
    for (const auto& entry : scene.manifest.entries) {
        if (entries.emplace(entry.sha256, &entry).second) {
            request.add_sha256(entry.sha256);
        }
    }
    v1::FindMissingBlobsResponse missing;
    Insist([&](grpc::ClientContext* context) {
        return blobs_->FindMissingBlobs(context, request, &missing);
    });
    std::uint64_t due = 0, done = 0;
    for (const auto& blob : missing.missing()) {
        due += entries.at(blob.sha256())->size - blob.offset();
    }
    for (const auto& blob : missing.missing()) {
        const ManifestEntry& entry = *entries.at(blob.sha256());
        UploadBlob(entry.sha256, entry.size, blob.offset(), scene.files.at(entry.path),
                   [&](std::uint64_t bytes) { progress(done + bytes, due); });
        done += entry.size - blob.offset();
    }
}

void Client::UploadBlob(const std::string& sha256, std::uint64_t size, std::uint64_t offset,
                        const std::string& path,
                        const std::function<void(std::uint64_t)>& progress) {
    Retry retry(this);
    const std::uint64_t start = offset;
    int damages = 0;
    std::uint64_t kept = offset;  // bytes that the server is known to have
    for (;;) {
        std::ifstream in(path, std::ios::binary);
        in.seekg(static_cast<std::streamoff>(offset));
        CallContext context(this, kChunkSeconds);
        v1::WriteBlobResponse response;
        const auto writer = blobs_->WriteBlob(context.get(), &response);
        v1::WriteBlobRequest chunk;
        chunk.set_sha256(sha256);
        chunk.set_size(size);
        std::string buffer;
        do {
            // Half the limit: room for the message's other fields.
            buffer.resize(std::min<std::uint64_t>(codec::kMaxChunk / 2, size - offset));
            if (!in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()))) {
                context.get()->TryCancel();
                writer->Finish();
                throw Error(ErrorCode::kDataLoss,
                            fmt::format("{}: changed while it was sent; try again", path));
            }
            chunk.set_offset(offset);
            chunk.set_data(buffer);
            if (!writer->Write(chunk)) {
                break;
            }
            chunk.clear_sha256();
            chunk.clear_size();
            offset += buffer.size();
            progress(offset - std::min(start, offset));
        } while (offset < size);
        writer->WritesDone();
        const auto status = writer->Finish();
        if (status.ok()) {
            return;
        }
        // Bits changed on the way. The server has thrown away what it got.
        const bool damaged = status.error_code() == grpc::StatusCode::DATA_LOSS;
        if (!damaged || ++damages == kUploadAttempts) {
            retry.Wait(status);
        }

        // Where the server wants us to go on.
        v1::FindMissingBlobsRequest request;
        request.add_sha256(sha256);
        v1::FindMissingBlobsResponse missing;
        CallContext ask(this, kUnarySeconds);
        if (!blobs_->FindMissingBlobs(ask.get(), request, &missing).ok()) {
            continue;
        }
        if (missing.missing().empty()) {
            return;
        }
        offset = missing.missing(0).offset();
        if (offset > std::exchange(kept, offset)) {
            retry.Progress();
        }
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

void Client::Fetch(const std::string& name, OutputFile* file) {
    v1::FetchResultRequest request;
    request.set_name(JobName(name));
    Sha256 sha;
    for (Retry retry(this);;) {
        request.set_offset(file->size());
        CallContext context(this, kChunkSeconds);
        const auto reader = jobs_->FetchResult(context.get(), request);
        v1::FetchResultResponse chunk;
        std::uint64_t size = 0;
        std::string sha256;
        try {
            while (reader->Read(&chunk)) {
                if (chunk.offset() != file->size()) {
                    throw Error(
                        ErrorCode::kDataLoss,
                        fmt::format("{}: the server sent byte {} of {} instead of {}",
                                    server_.address, chunk.offset(), request.name(), file->size()));
                }
                sha.Update(chunk.data());
                file->Append(chunk.data());
                size = chunk.size();
                sha256 = chunk.sha256();
                retry.Progress();
            }
        } catch (...) {
            context.get()->TryCancel();
            reader->Finish();
            throw;
        }
        const auto status = reader->Finish();
        if (status.ok() && file->size() == size) {
            if (sha.HexDigest() != sha256) {
                throw Error(
                    ErrorCode::kDataLoss,
                    fmt::format("{}: the result of {} was damaged on its way; fetch it again",
                                server_.address, request.name()));
            }
            return;
        }
        retry.Wait(status.ok() ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "the result broke off")
                               : status);
    }
}

}  // namespace relume::client
