// Uploads over a line that changes bits.
#include <gmock/gmock.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>

#include "client/lib/client.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/sha256.h"
#include "relume/v1/blobs.grpc.pb.h"

namespace relume::client {
namespace {

// Keeps one blob, and throws away one that is not what it should be, as the server does.
class FakeStore final : public v1::BlobService::Service {
  public:
    grpc::Status FindMissingBlobs(grpc::ServerContext*, const v1::FindMissingBlobsRequest* request,
                                  v1::FindMissingBlobsResponse* response) override {
        if (!kept) {
            response->add_missing()->set_sha256(request->sha256(0));
        }
        return grpc::Status::OK;
    }
    grpc::Status WriteBlob(grpc::ServerContext*, grpc::ServerReader<v1::WriteBlobRequest>* reader,
                           v1::WriteBlobResponse*) override {
        ++uploads;
        std::string sha256, bytes;
        for (v1::WriteBlobRequest chunk; reader->Read(&chunk);) {
            sha256 = sha256.empty() ? chunk.sha256() : sha256;
            bytes += chunk.data();
        }
        if (to_mangle > 0) {
            --to_mangle;
            bytes.back() = static_cast<char>(bytes.back() ^ 1);
        }
        if (Sha256Hex(bytes) != sha256) {
            return {grpc::StatusCode::DATA_LOSS, "it came with other contents; upload it again"};
        }
        kept = true;
        return grpc::Status::OK;
    }

    std::atomic<int> to_mangle{0}, uploads{0};
    std::atomic<bool> kept{false};
};

class UploadTest : public testing::Test {
  protected:
    UploadTest() {
        int port = 0;
        grpc::ServerBuilder builder;
        builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
        builder.RegisterService(&store);
        server = builder.BuildAndStart();
        client = std::make_unique<Client>(Endpoint{"127.0.0.1:" + std::to_string(port), {}});
        // More than one message.
        const std::string bytes(3 << 20, 'x');
        const std::string path = (folder.path() / "scene.gltf").string();
        std::ofstream(path) << bytes;
        scene.manifest.main = "scene.gltf";
        scene.manifest.entries.push_back({"scene.gltf", bytes.size(), Sha256Hex(bytes)});
        scene.files["scene.gltf"] = path;
    }
    ~UploadTest() override {
        server->Shutdown();
        server->Wait();
    }
    void Upload() {
        client->UploadScene(scene,
                            [&](std::uint64_t done, std::uint64_t due) { EXPECT_LE(done, due); });
    }

    TemporaryFolder folder;
    FakeStore store;
    std::unique_ptr<grpc::Server> server;
    std::unique_ptr<Client> client;
    LocalScene scene;
};

TEST_F(UploadTest, WhatIsDamagedOnTheWayIsSentAgain) {
    store.to_mangle = Client::kUploadAttempts - 1;
    Upload();
    EXPECT_TRUE(store.kept);
    EXPECT_EQ(store.uploads, Client::kUploadAttempts);
}

TEST_F(UploadTest, AfterAFewTimesItIsAnError) {
    store.to_mangle = 100;
    try {
        Upload();
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kDataLoss);
        EXPECT_THAT(error.what(), testing::HasSubstr("upload it again"));
    }
    EXPECT_FALSE(store.kept);
    EXPECT_EQ(store.uploads, Client::kUploadAttempts);
}

}  // namespace
}  // namespace relume::client
