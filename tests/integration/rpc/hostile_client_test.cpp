#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <functional>

#include "tests/integration/rpc/farm_fixture.h"

namespace relume::server {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using Code = grpc::StatusCode;

// Whatever one client wants: others get their images, and disk and memory stay bounded.
class HostileClientTest : public FarmFixture {
  protected:
    void Finish() {
        const auto worker = StartWorker();
        const v1::Job job = WaitForEnd(MustCreate(Spec()).name());
        EXPECT_EQ(job.state(), v1::JOB_STATE_SUCCEEDED) << job.message();
    }
    std::uint64_t BytesOfBlobs() const {
        std::uint64_t bytes = 0;
        for (const auto& entry :
             std::filesystem::recursive_directory_iterator(folder.path() / "blobs")) {
            bytes += entry.is_regular_file() ? entry.file_size() : 0;
        }
        return bytes;
    }
};

TEST_F(HostileClientTest, JobsOfOneClientAreCountedUntilTheyAreOver) {
    ServerOptions options;
    options.coordinator.quotas.client_jobs = 3;
    Restart(options);
    const v1::JobSpec spec = Spec();
    const v1::Job first = MustCreate(spec);
    MustCreate(spec);
    MustCreate(spec);
    v1::Job job;
    for (int i = 0; i < 500; ++i) {
        v1::JobSpec other = spec;
        other.set_owner("client " + std::to_string(i));  // is believed by people alone
        const grpc::Status refused = Create(other, &job);
        ASSERT_EQ(refused.error_code(), Code::RESOURCE_EXHAUSTED);
        ASSERT_THAT(refused.error_message(),
                    AllOf(HasSubstr("3 jobs"), HasSubstr("--client-jobs")));
    }
    ASSERT_TRUE(Cancel(first.name(), &job).ok());
    MustCreate(spec);
    EXPECT_EQ(Create(spec, &job).error_code(), Code::RESOURCE_EXHAUSTED);
    // They count after a restart, too.
    Restart(options);
    EXPECT_EQ(Create(spec, &job).error_code(), Code::RESOURCE_EXHAUSTED);
    // What asks for nothing is answered.
    EXPECT_TRUE(Create(spec, &job, "", true).ok());
}

TEST_F(HostileClientTest, JobsOfAllClientsAreCounted) {
    ServerOptions options;
    options.coordinator.quotas.jobs = 2;
    Restart(options);
    MustCreate(Spec());
    MustCreate(Spec());
    v1::Job job;
    const grpc::Status refused = Create(Spec(), &job);
    EXPECT_EQ(refused.error_code(), Code::RESOURCE_EXHAUSTED);
    EXPECT_THAT(refused.error_message(), HasSubstr("--jobs"));
}

TEST_F(HostileClientTest, NamesOfSceneFilesAreCounted) {
    v1::JobSpec spec = Spec();
    const v1::ManifestEntry entry = spec.scene().entries(0);
    for (int i = 0; i < 3000; ++i) {
        v1::ManifestEntry* more = spec.mutable_scene()->add_entries();
        *more = entry;
        more->set_path(std::to_string(i) + std::string(900, 'x'));
    }
    v1::Job job;
    grpc::Status status;
    int made = 0;
    for (; made < 40 && status.ok(); ++made) {
        status = Create(spec, &job);
    }
    EXPECT_GT(made, 10);
    EXPECT_EQ(status.error_code(), Code::RESOURCE_EXHAUSTED);
    EXPECT_THAT(status.error_message(), HasSubstr("scene files"));
}

TEST_F(HostileClientTest, WhatNoImageCanBeIsRefused) {
    ServerOptions options;
    options.coordinator.quotas.pixels = 1'000'000;
    Restart(options);
    const auto refused = [&](Code code, const std::string& why,
                             const std::function<void(v1::JobSpec*)>& change) {
        v1::JobSpec spec = Spec();
        change(&spec);
        v1::Job job;
        const grpc::Status status = Create(spec, &job);
        EXPECT_EQ(status.error_code(), code) << status.error_message();
        EXPECT_THAT(status.error_message(), HasSubstr(why));
    };
    refused(Code::RESOURCE_EXHAUSTED, "--max-pixels", [](v1::JobSpec* s) {
        s->mutable_settings()->set_width(1001);
        s->mutable_settings()->set_height(1000);
    });
    refused(Code::INVALID_ARGUMENT, "spp", [](v1::JobSpec* s) { s->set_spp(std::pow(2.0, 60)); });
    refused(Code::INVALID_ARGUMENT, "max-spp",
            [](v1::JobSpec* s) { s->set_max_spp(~std::uint32_t{0}); });
    refused(Code::INVALID_ARGUMENT, "min-spp",
            [](v1::JobSpec* s) { s->set_min_spp(~std::uint32_t{0}); });
    refused(Code::INVALID_ARGUMENT, "time-limit",
            [](v1::JobSpec* s) { s->set_time_limit(-1e300); });
    refused(Code::INVALID_ARGUMENT, "size", [](v1::JobSpec* s) {
        s->mutable_settings()->set_width(std::numeric_limits<std::int32_t>::max());
        s->mutable_settings()->set_height(std::numeric_limits<std::int32_t>::max());
    });
    refused(Code::INVALID_ARGUMENT, "crop", [](v1::JobSpec* s) {
        s->mutable_settings()->mutable_crop()->set_x0(std::numeric_limits<std::int32_t>::min());
        s->mutable_settings()->mutable_crop()->set_x1(std::numeric_limits<std::int32_t>::max());
        s->mutable_settings()->mutable_crop()->set_y1(1);
    });
    // Paths that leave the scene's folder, or hold what no name does.
    for (const std::string& path :
         {std::string("../../etc/shadow"), std::string("/etc/shadow"), std::string("a/../../b"),
          std::string("a\0b", 3), std::string("a\nb"), std::string("\x1b[2J"),
          std::string(5000, 'a'), std::string("a//b"), std::string("..\\b"), std::string(".")}) {
        refused(Code::INVALID_ARGUMENT, "must be relative", [&](v1::JobSpec* s) {
            auto* more = s->mutable_scene()->add_entries();
            *more = s->scene().entries(0);
            more->set_path(path);
        });
    }
    // A crop of a large frame is as large as the crop.
    v1::JobSpec spec = Spec();
    spec.mutable_settings()->set_width(4000);
    spec.mutable_settings()->set_height(4000);
    spec.mutable_settings()->mutable_crop()->set_x1(48);
    spec.mutable_settings()->mutable_crop()->set_y1(40);
    v1::Job job;
    EXPECT_TRUE(Create(spec, &job).ok());
    EXPECT_TRUE(Cancel(job.name(), &job).ok());
    Finish();
}

TEST_F(HostileClientTest, AnUploadWithoutEndStopsAndLeavesNothing) {
    const std::string sha256(64, 'a');
    const auto stream = [&](std::uint64_t size, int pieces) {
        grpc::ClientContext context;
        v1::WriteBlobResponse response;
        const auto writer = blobs->WriteBlob(&context, &response);
        v1::WriteBlobRequest request;
        request.set_sha256(sha256);
        request.set_size(size);
        request.set_data(std::string(1 << 20, 'x'));
        int sent = 0;
        for (; sent < pieces && writer->Write(request); ++sent) {
            request.set_offset(request.offset() + request.data().size());
        }
        EXPECT_LT(sent, pieces);
        return writer->Finish();
    };
    const std::uint64_t before = BytesOfBlobs();
    EXPECT_EQ(stream((3 << 20) - 1, 100'000).error_code(), Code::INVALID_ARGUMENT);
    EXPECT_EQ(BytesOfBlobs(), before);
    EXPECT_EQ(stream(std::uint64_t{1} << 60, 100'000).error_code(), Code::RESOURCE_EXHAUSTED);
    EXPECT_EQ(stream(~std::uint64_t{0}, 100'000).error_code(), Code::RESOURCE_EXHAUSTED);
    EXPECT_EQ(BytesOfBlobs(), before);
    // As much as fits, of what it is not: gone, too, and others have the room.
    EXPECT_EQ(stream(8 << 20, 100'000).error_code(), Code::DATA_LOSS);
    EXPECT_EQ(BytesOfBlobs(), before);
    Finish();
}

TEST_F(HostileClientTest, WatchersThatNeverReadHoldUpNobody) {
    ServerOptions options;
    options.coordinator.quotas.client_streams = 12;
    Restart(options);
    const v1::Job job = MustCreate(Spec());
    struct Watcher {
        grpc::ClientContext context;
        std::unique_ptr<grpc::ClientReader<v1::WatchJobResponse>> reader;
    };
    std::vector<std::unique_ptr<Watcher>> watchers;
    v1::WatchJobRequest request;
    request.set_name(job.name());
    for (int i = 0; i < 11; ++i) {
        watchers.push_back(std::make_unique<Watcher>());
        watchers.back()->reader = jobs->WatchJob(&watchers.back()->context, request);
        watchers.back()->reader->WaitForInitialMetadata();
    }
    {
        const auto worker = StartWorker();
        WaitUntil(job.name(),
                  [](const v1::Job& j) { return j.state() == v1::JOB_STATE_SUCCEEDED; });
    }
    for (const auto& watcher : watchers) {
        watcher->context.TryCancel();
        watcher->reader->Finish();
    }
}

TEST_F(HostileClientTest, StreamsOfOneAddressAreCounted) {
    ServerOptions options;
    options.coordinator.quotas.client_streams = 5;
    Restart(options);
    const v1::Job job = MustCreate(Spec());
    v1::WatchJobRequest request;
    request.set_name(job.name());
    std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
    std::vector<std::unique_ptr<grpc::ClientReader<v1::WatchJobResponse>>> readers;
    v1::WatchJobResponse response;
    for (int i = 0; i < 5; ++i) {
        contexts.push_back(std::make_unique<grpc::ClientContext>());
        readers.push_back(jobs->WatchJob(contexts.back().get(), request));
        EXPECT_TRUE(readers.back()->Read(&response));
    }
    grpc::ClientContext context;
    const auto one_more = jobs->WatchJob(&context, request);
    EXPECT_FALSE(one_more->Read(&response));
    const grpc::Status refused = one_more->Finish();
    EXPECT_EQ(refused.error_code(), Code::RESOURCE_EXHAUSTED);
    EXPECT_THAT(refused.error_message(), HasSubstr("--client-streams"));
    EXPECT_EQ(Upload("x", Sha256Hex("x")).error_code(), Code::RESOURCE_EXHAUSTED);
    // Calls that are answered at once are not counted.
    v1::Job now;
    EXPECT_TRUE(Get(job.name(), &now).ok());
    for (std::size_t i = 0; i < readers.size(); ++i) {
        contexts[i]->TryCancel();
        readers[i]->Finish();
    }
}

}  // namespace
}  // namespace relume::server
