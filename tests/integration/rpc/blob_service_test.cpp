#include <gmock/gmock.h>

#include "proto/codec/codec.h"
#include "tests/integration/rpc/farm_fixture.h"

namespace relume::server {
namespace {

using testing::HasSubstr;

class BlobServiceTest : public FarmFixture {
  protected:
    grpc::Status Missing(const std::string& sha256, v1::FindMissingBlobsResponse* response) {
        grpc::ClientContext context;
        v1::FindMissingBlobsRequest request;
        request.add_sha256(sha256);
        return blobs->FindMissingBlobs(&context, request, response);
    }
    // Sends pieces from an offset on; `size` is that of the whole.
    grpc::Status Write(const std::string& sha256, std::uint64_t size, std::uint64_t offset,
                       const std::vector<std::string>& pieces, std::uint64_t* committed) {
        grpc::ClientContext context;
        v1::WriteBlobResponse response;
        const auto writer = blobs->WriteBlob(&context, &response);
        v1::WriteBlobRequest request;
        request.set_sha256(sha256);
        request.set_size(size);
        for (const auto& piece : pieces) {
            request.set_offset(offset);
            request.set_data(piece);
            if (!writer->Write(request)) {
                break;
            }
            offset += piece.size();
            request.Clear();
        }
        writer->WritesDone();
        const auto status = writer->Finish();
        *committed = response.committed_size();
        return status;
    }
    grpc::Status Read(const std::string& sha256, std::uint64_t offset, std::string* bytes) {
        grpc::ClientContext context;
        v1::ReadBlobRequest request;
        request.set_sha256(sha256);
        request.set_offset(offset);
        const auto reader = blobs->ReadBlob(&context, request);
        v1::ReadBlobResponse response;
        while (reader->Read(&response)) {
            EXPECT_EQ(response.offset(), offset + bytes->size());
            EXPECT_LE(response.ByteSizeLong(), codec::kMaxChunk);
            *bytes += response.data();
        }
        return reader->Finish();
    }
};

TEST_F(BlobServiceTest, ABrokenUploadIsTakenUpAndReadBack) {
    std::string bytes;
    for (int i = 0; i < 400'000; ++i) {
        bytes += static_cast<char>(i * 7 % 251);
        bytes += static_cast<char>(i % 13);
        bytes += static_cast<char>(i >> 8);
    }
    const std::string sha256 = Sha256Hex(bytes);
    std::uint64_t committed = 0;
    const auto broken = Write(sha256, bytes.size(), 0, {bytes.substr(0, 500'000)}, &committed);
    EXPECT_EQ(broken.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(broken.error_message(), HasSubstr("ended at byte 500000"));
    v1::FindMissingBlobsResponse missing;
    ASSERT_TRUE(Missing(sha256, &missing).ok());
    ASSERT_EQ(missing.missing_size(), 1);
    EXPECT_EQ(missing.missing(0).offset(), 500'000u);
    ASSERT_TRUE(Write(sha256, bytes.size(), 500'000,
                      {bytes.substr(500'000, 600'000), bytes.substr(1'100'000)}, &committed)
                    .ok());
    EXPECT_EQ(committed, bytes.size());
    missing.Clear();
    ASSERT_TRUE(Missing(sha256, &missing).ok());
    EXPECT_EQ(missing.missing_size(), 0);
    // Again: nothing to do.
    EXPECT_TRUE(Write(sha256, bytes.size(), 0, {bytes.substr(0, 10)}, &committed).ok());
    EXPECT_EQ(committed, bytes.size());
    std::string all, rest;
    EXPECT_TRUE(Read(sha256, 0, &all).ok());
    EXPECT_TRUE(all == bytes);
    EXPECT_TRUE(Read(sha256, 1'000'000, &rest).ok());
    EXPECT_TRUE(rest == bytes.substr(1'000'000));
    EXPECT_TRUE(Read(sha256, bytes.size(), &(rest = "")).ok());
}

TEST_F(BlobServiceTest, AnEmptyBlobIsABlob) {
    EXPECT_TRUE(Upload("", Sha256Hex("")).ok());
    std::string bytes;
    EXPECT_TRUE(Read(Sha256Hex(""), 0, &bytes).ok());
    EXPECT_EQ(bytes, "");
}

TEST_F(BlobServiceTest, BadRequestsGetClearStatusesAndLeaveNothing) {
    std::uint64_t committed = 0;
    std::string bytes;
    v1::FindMissingBlobsResponse missing;
    const std::string sha256 = Sha256Hex("promised");
    using Code = grpc::StatusCode;
    EXPECT_EQ(Missing("../../etc/passwd", &missing).error_code(), Code::INVALID_ARGUMENT);
    EXPECT_EQ(Read("../../etc/passwd", 0, &bytes).error_code(), Code::INVALID_ARGUMENT);
    EXPECT_EQ(Write("../evil", 4, 0, {"evil"}, &committed).error_code(), Code::INVALID_ARGUMENT);
    EXPECT_EQ(Write(sha256, 8, 0, {"given..."}, &committed).error_code(), Code::DATA_LOSS);
    EXPECT_EQ(Write(sha256, 8, 5, {"xxx"}, &committed).error_code(), Code::INVALID_ARGUMENT);
    EXPECT_EQ(Write(sha256, 4, 0, {"promised"}, &committed).error_code(), Code::INVALID_ARGUMENT);
    EXPECT_EQ(Write(sha256, std::uint64_t{1} << 62, 0, {"x"}, &committed).error_code(),
              Code::RESOURCE_EXHAUSTED);
    EXPECT_EQ(Write(sha256, 3 << 20, 0, {std::string((1 << 20) + 1, 'x')}, &committed).error_code(),
              Code::INVALID_ARGUMENT);
    EXPECT_EQ(Write(sha256, 8 << 20, 0, {std::string(5 << 20, 'x')}, &committed).error_code(),
              Code::RESOURCE_EXHAUSTED);
    EXPECT_EQ(Read(sha256, 0, &bytes).error_code(), Code::NOT_FOUND);
    // The server lives, and the right bytes are taken.
    EXPECT_TRUE(Upload("promised", sha256).ok());
    EXPECT_EQ(Read(sha256, 9, &bytes).error_code(), Code::INVALID_ARGUMENT);
}

TEST_F(BlobServiceTest, BlobsOutliveTheServer) {
    ASSERT_TRUE(Upload("kept", Sha256Hex("kept")).ok());
    Restart();
    std::string bytes;
    EXPECT_TRUE(Read(Sha256Hex("kept"), 0, &bytes).ok());
    EXPECT_EQ(bytes, "kept");
}

}  // namespace
}  // namespace relume::server
