#pragma once

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/base/files.h"
#include "core/base/sha256.h"
#include "relume/v1/blobs.grpc.pb.h"
#include "relume/v1/jobs.grpc.pb.h"
#include "relume/v1/work.grpc.pb.h"
#include "server/rpc/server.h"
#include "tests/integration/rpc/fake_worker.h"

namespace relume::server {

// A server on a free port of loopback, with a fresh folder, and stubs for it.
class FarmFixture : public testing::Test {
  protected:
    FarmFixture() { Restart(); }

    void Restart(ServerOptions options = {}) {
        server.reset();
        options.coordinator.data = folder.path();
        options.coordinator.blob_quota = 16 << 20;
        server = std::make_unique<Server>(options);
        channel =
            grpc::CreateChannel(ToString(server->address()), grpc::InsecureChannelCredentials());
        jobs = v1::JobService::NewStub(channel);
        blobs = v1::BlobService::NewStub(channel);
        work = v1::WorkerService::NewStub(channel);
    }

    std::unique_ptr<FakeWorker> StartWorker(FakeWorkerOptions options = {}) {
        return std::make_unique<FakeWorker>(channel, options);
    }

    grpc::Status Upload(const std::string& bytes, const std::string& sha256) {
        grpc::ClientContext context;
        v1::WriteBlobResponse response;
        const auto writer = blobs->WriteBlob(&context, &response);
        v1::WriteBlobRequest request;
        request.set_sha256(sha256);
        request.set_size(bytes.size());
        request.set_data(bytes);
        writer->Write(request);
        writer->WritesDone();
        return writer->Finish();
    }

    // A job of 48x40 pixels on a scene whose one file is uploaded.
    v1::JobSpec Spec(const std::string& sampler = "uniform", int tile_size = 16) {
        const std::string scene = "pretend that this is glTF";
        EXPECT_TRUE(Upload(scene, Sha256Hex(scene)).ok());
        v1::JobSpec spec;
        spec.mutable_scene()->set_main("scene.gltf");
        auto* entry = spec.mutable_scene()->add_entries();
        entry->set_path("scene.gltf");
        entry->set_size(scene.size());
        entry->set_sha256(Sha256Hex(scene));
        spec.mutable_settings()->set_width(48);
        spec.mutable_settings()->set_height(40);
        spec.set_sampler(sampler);
        spec.set_filter("none");
        spec.set_spp(8);
        spec.set_tile_size(tile_size);
        return spec;
    }

    grpc::Status Create(const v1::JobSpec& spec, v1::Job* job, const std::string& request_id = "",
                        bool validate_only = false) {
        grpc::ClientContext context;
        v1::CreateJobRequest request;
        *request.mutable_spec() = spec;
        request.set_request_id(request_id);
        request.set_validate_only(validate_only);
        v1::CreateJobResponse response;
        const auto status = jobs->CreateJob(&context, request, &response);
        *job = response.job();
        return status;
    }
    v1::Job MustCreate(const v1::JobSpec& spec) {
        v1::Job job;
        const auto status = Create(spec, &job);
        EXPECT_TRUE(status.ok()) << status.error_message();
        return job;
    }
    grpc::Status Get(const std::string& name, v1::Job* job) {
        grpc::ClientContext context;
        v1::GetJobRequest request;
        request.set_name(name);
        v1::GetJobResponse response;
        const auto status = jobs->GetJob(&context, request, &response);
        *job = response.job();
        return status;
    }
    grpc::Status Cancel(const std::string& name, v1::Job* job) {
        grpc::ClientContext context;
        v1::CancelJobRequest request;
        request.set_name(name);
        v1::CancelJobResponse response;
        const auto status = jobs->CancelJob(&context, request, &response);
        *job = response.job();
        return status;
    }
    // All events until the stream ends.
    grpc::Status Watch(const std::string& name, std::uint64_t from,
                       std::vector<v1::WatchJobResponse>* events) {
        grpc::ClientContext context;
        v1::WatchJobRequest request;
        request.set_name(name);
        request.set_from_event(from);
        const auto reader = jobs->WatchJob(&context, request);
        v1::WatchJobResponse response;
        while (reader->Read(&response)) {
            events->push_back(response);
        }
        return reader->Finish();
    }
    v1::Job WaitForEnd(const std::string& name) {
        std::vector<v1::WatchJobResponse> events;
        EXPECT_TRUE(Watch(name, 0, &events).ok());
        return events.empty() ? v1::Job() : events.back().job();
    }
    v1::Job Now(const std::string& name) {
        v1::Job job;
        const auto status = Get(name, &job);
        EXPECT_TRUE(status.ok()) << status.error_message();
        return job;
    }
    // The job as soon as it is `good`, which has a minute.
    v1::Job WaitUntil(const std::string& name, const std::function<bool(const v1::Job&)>& good) {
        v1::Job job;
        const bool came = WaitFor([&] { return good(job = Now(name)); });
        EXPECT_TRUE(came) << "it never comes to that: " << job.ShortDebugString();
        return job;
    }
    // The server has seen all workers go.
    void WaitUntilAlone() {
        EXPECT_TRUE(WaitFor([&] {
            grpc::ClientContext context;
            v1::ListWorkersResponse list;
            return jobs->ListWorkers(&context, {}, &list).ok() && list.workers_size() == 0;
        })) << "workers stay";
    }
    // Whether it comes true within a minute.
    static bool WaitFor(const std::function<bool()>& happens) {
        const auto give_up = std::chrono::steady_clock::now() + std::chrono::minutes(1);
        while (!happens()) {
            if (std::chrono::steady_clock::now() > give_up) {
                return false;
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        return true;
    }
    // What an undisturbed server makes of the job.
    v1::Job Undisturbed(const v1::JobSpec& spec) {
        const auto worker = StartWorker();
        return WaitForEnd(MustCreate(spec).name());
    }
    // The image's file.
    std::string Fetch(const std::string& name) {
        grpc::ClientContext context;
        v1::FetchResultRequest request;
        request.set_name(name);
        const auto reader = jobs->FetchResult(&context, request);
        std::string bytes;
        for (v1::FetchResultResponse chunk; reader->Read(&chunk);) {
            bytes += chunk.data();
        }
        const auto status = reader->Finish();
        EXPECT_TRUE(status.ok()) << status.error_message();
        return bytes;
    }

    TemporaryFolder folder;
    std::unique_ptr<Server> server;
    std::shared_ptr<grpc::Channel> channel;
    std::unique_ptr<v1::JobService::Stub> jobs;
    std::unique_ptr<v1::BlobService::Stub> blobs;
    std::unique_ptr<v1::WorkerService::Stub> work;
};

}  // namespace relume::server
