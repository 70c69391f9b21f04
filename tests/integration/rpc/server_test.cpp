#include "server/rpc/server.h"

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/byte_buffer.h>

#include "core/base/error.h"
#include "tests/integration/rpc/farm_fixture.h"

namespace relume::server {
namespace {

using testing::HasSubstr;

// One message there and one back, by the method's name alone: health and reflection have no
// generated code in Debian.
std::string CallRaw(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                    const std::string& request) {
    grpc::GenericStub stub(channel);
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    const auto next = [&] {
        void* tag = nullptr;
        bool ok = false;
        EXPECT_TRUE(queue.Next(&tag, &ok));
        EXPECT_TRUE(ok);
    };
    const auto stream = stub.PrepareCall(&context, method, &queue);
    stream->StartCall(nullptr);
    next();
    grpc::Slice slice(request);
    stream->Write(grpc::ByteBuffer(&slice, 1), nullptr);
    next();
    grpc::ByteBuffer response;
    stream->Read(&response, nullptr);
    next();
    stream->WritesDone(nullptr);
    next();
    grpc::Status status;
    stream->Finish(&status, nullptr);
    next();
    EXPECT_TRUE(status.ok()) << status.error_message();
    std::vector<grpc::Slice> slices;
    EXPECT_TRUE(response.Dump(&slices).ok());
    std::string bytes;
    for (const auto& s : slices) {
        bytes.append(reinterpret_cast<const char*>(s.begin()), s.size());
    }
    return bytes;
}

class ServerTest : public FarmFixture {};

TEST_F(ServerTest, HealthIsServing) {
    const std::string serving("\x08\x01", 2);  // status = 1
    EXPECT_EQ(CallRaw(channel, "/grpc.health.v1.Health/Check", ""), serving);
    const std::string service = "relume.v1.JobService";
    const std::string request =
        "\x0a" + std::string(1, static_cast<char>(service.size())) + service;
    EXPECT_EQ(CallRaw(channel, "/grpc.health.v1.Health/Check", request), serving);
}

TEST_F(ServerTest, ReflectionListsTheServices) {
    const std::string list("\x3a\x01*", 3);  // list_services = "*"
    const std::string answer =
        CallRaw(channel, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", list);
    for (const char* name : {"relume.v1.JobService", "relume.v1.BlobService",
                             "relume.v1.WorkerService", "grpc.health.v1.Health"}) {
        EXPECT_THAT(answer, HasSubstr(name));
    }
}

TEST_F(ServerTest, APortThatIsTakenIsSaid) {
    ServerOptions options;
    options.listen = server->address();
    const TemporaryFolder other;
    options.coordinator.data = other.path();
    try {
        const Server second(options);
        FAIL() << "two servers on one port";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kUnavailable);
        EXPECT_THAT(error.what(), HasSubstr(ToString(server->address())));
    }
}

TEST_F(ServerTest, AFolderThatIsInUseIsSaid) {
    ServerOptions options;
    options.coordinator.data = folder.path();
    EXPECT_THROW(Server{options}, Error);
}

TEST_F(ServerTest, StoppingDrainsWorkersAndEndsWatches) {
    const v1::Job job = MustCreate(Spec());
    const auto worker = StartWorker({.hold = true});
    grpc::ClientContext context;
    v1::WatchJobRequest request;
    request.set_name(job.name());
    const auto reader = jobs->WatchJob(&context, request);
    v1::WatchJobResponse event;
    ASSERT_TRUE(reader->Read(&event));
    while (event.job().state() != v1::JOB_STATE_RENDERING && reader->Read(&event)) {
    }
    server.reset();
    EXPECT_TRUE(worker->Join().ok());
    EXPECT_TRUE(worker->drained());
    while (reader->Read(&event)) {
    }
    EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(ServerTest, LeftoversOfAnEarlierRunDoNoHarm) {
    const auto worker = StartWorker();
    const v1::Job job = WaitForEnd(MustCreate(Spec()).name());
    EXPECT_EQ(job.state(), v1::JOB_STATE_SUCCEEDED);
    WriteFileAtomically(folder.path() / "results" / "strange.exr.tmp", "half");
    Restart();
    v1::Job kept;
    EXPECT_TRUE(Get(job.name(), &kept).ok());
    EXPECT_EQ(kept.image_sha256(), job.image_sha256());
    const auto again = StartWorker();
    EXPECT_EQ(WaitForEnd(MustCreate(Spec()).name()).image_sha256(), job.image_sha256());
}

}  // namespace
}  // namespace relume::server
