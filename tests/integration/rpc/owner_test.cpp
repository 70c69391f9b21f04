#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "core/base/files.h"
#include "core/base/sha256.h"
#include "proto/channel/credentials.h"
#include "relume/v1/blobs.grpc.pb.h"
#include "relume/v1/jobs.grpc.pb.h"
#include "server/rpc/access.h"
#include "server/rpc/server.h"
#include "tests/support/test_certs.h"

namespace relume::server {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using Code = grpc::StatusCode;

// A farm with certificates, and clients of several names.
class OwnerTest : public testing::Test {
  protected:
    OwnerTest() : certs("client=alice client=bob operator=carol admin") {
        ServerOptions options;
        options.tls = certs.Pems("server");
        options.coordinator.data = folder.path();
        options.coordinator.quotas.client_jobs = 2;
        server = std::make_unique<Server>(options);
    }

    std::unique_ptr<v1::JobService::Stub> As(const std::string& who) {
        const auto channel = grpc::CreateChannel(ToString(server->address()),
                                                 channel::MakeCredentials(certs.Pems(who)));
        if (!uploaded) {
            grpc::ClientContext context;
            v1::WriteBlobResponse response;
            const auto writer = v1::BlobService::NewStub(channel)->WriteBlob(&context, &response);
            v1::WriteBlobRequest request;
            request.set_sha256(Sha256Hex(kScene));
            request.set_size(kScene.size());
            request.set_data(kScene);
            writer->Write(request);
            writer->WritesDone();
            EXPECT_TRUE(writer->Finish().ok());
            uploaded = true;
        }
        return v1::JobService::NewStub(channel);
    }
    grpc::Status Create(const std::string& who, v1::Job* job, const std::string& said = "") {
        v1::CreateJobRequest request;
        v1::JobSpec* spec = request.mutable_spec();
        spec->mutable_scene()->set_main("scene.gltf");
        auto* entry = spec->mutable_scene()->add_entries();
        entry->set_path("scene.gltf");
        entry->set_size(kScene.size());
        entry->set_sha256(Sha256Hex(kScene));
        spec->mutable_settings()->set_width(8);
        spec->mutable_settings()->set_height(8);
        spec->set_spp(4);
        spec->set_owner(said);
        grpc::ClientContext context;
        v1::CreateJobResponse response;
        const auto status = As(who)->CreateJob(&context, request, &response);
        *job = response.job();
        return status;
    }
    grpc::Status Cancel(const std::string& who, const std::string& name) {
        grpc::ClientContext context;
        v1::CancelJobRequest request;
        request.set_name(name);
        v1::CancelJobResponse response;
        return As(who)->CancelJob(&context, request, &response);
    }
    grpc::Status Extend(const std::string& who, const std::string& name) {
        grpc::ClientContext context;
        v1::ExtendJobRequest request;
        request.set_name(name);
        request.set_spp(8);
        v1::ExtendJobResponse response;
        return As(who)->ExtendJob(&context, request, &response);
    }

    const std::string kScene = "pretend that this is glTF";
    TestCerts certs;
    TemporaryFolder folder;
    std::unique_ptr<Server> server;
    bool uploaded = false;
};

TEST_F(OwnerTest, AJobIsChangedByItsOwnerAnOperatorOrAnAdminAlone) {
    v1::Job job;
    ASSERT_TRUE(Create("alice", &job, "bob").ok());
    EXPECT_EQ(job.spec().owner(), "alice");  // whatever she says
    const grpc::Status refused = Cancel("bob", job.name());
    EXPECT_EQ(refused.error_code(), Code::PERMISSION_DENIED);
    EXPECT_THAT(refused.error_message(),
                AllOf(HasSubstr("'alice'"), HasSubstr("'bob'"), HasSubstr("relume/operator")));
    EXPECT_EQ(Extend("bob", job.name()).error_code(), Code::PERMISSION_DENIED);
    EXPECT_EQ(Extend("alice", job.name()).error_code(), Code::FAILED_PRECONDITION);
    EXPECT_TRUE(Cancel("alice", job.name()).ok());
    for (const char* who : {"carol", "admin"}) {
        ASSERT_TRUE(Create("alice", &job).ok());
        EXPECT_TRUE(Cancel(who, job.name()).ok()) << who;
    }
    EXPECT_EQ(Cancel("bob", "jobs/none").error_code(), Code::NOT_FOUND);
}

TEST_F(OwnerTest, AWorkerIsReleasedByAnOperatorOrAnAdminAlone) {
    const auto release = [&](const std::string& who) {
        grpc::ClientContext context;
        v1::ReleaseWorkerRequest request;
        request.set_name("odd");
        v1::ReleaseWorkerResponse response;
        return As(who)->ReleaseWorker(&context, request, &response);
    };
    EXPECT_EQ(release("alice").error_code(), Code::PERMISSION_DENIED);
    for (const char* who : {"carol", "admin"}) {
        const grpc::Status status = release(who);
        EXPECT_EQ(status.error_code(), Code::NOT_FOUND) << who;
        EXPECT_THAT(status.error_message(), HasSubstr("'odd' is in quarantine")) << who;
    }
}

TEST_F(OwnerTest, QuotasAreOfTheCertificatesNameNotOfTheAddress) {
    v1::Job job;
    EXPECT_TRUE(Create("alice", &job).ok());
    EXPECT_TRUE(Create("alice", &job).ok());
    const grpc::Status refused = Create("alice", &job);
    EXPECT_EQ(refused.error_code(), Code::RESOURCE_EXHAUSTED);
    EXPECT_THAT(refused.error_message(), HasSubstr("alice has 2 jobs"));
    EXPECT_TRUE(Create("bob", &job).ok());
}

TEST_F(OwnerTest, AnOperatorIsAClientAndNoWorker) {
    v1::Job job;
    EXPECT_TRUE(Create("carol", &job).ok());
    EXPECT_EQ(RoleOfUri("spiffe://farm/relume/operator"), Role::kOperator);
}

TEST(HostOfPeer, IsTheAddressWithoutThePort) {
    EXPECT_EQ(HostOfPeer("ipv4:10.0.0.7:4711"), "10.0.0.7");
    EXPECT_EQ(HostOfPeer("ipv6:%5B::1%5D:4711"), "%5B::1%5D");
    EXPECT_EQ(HostOfPeer("unknown"), "unknown");
    EXPECT_EQ(HostOfPeer(""), "");
}

}  // namespace
}  // namespace relume::server
