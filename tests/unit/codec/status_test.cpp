#include "proto/codec/status.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace relume::codec {
namespace {

TEST(FromStatus, KeepsTheKindAndIsOneLine) {
    const std::pair<grpc::StatusCode, ErrorCode> kinds[] = {
        {grpc::StatusCode::INVALID_ARGUMENT, ErrorCode::kInvalidArgument},
        {grpc::StatusCode::NOT_FOUND, ErrorCode::kNotFound},
        {grpc::StatusCode::ALREADY_EXISTS, ErrorCode::kAlreadyExists},
        {grpc::StatusCode::PERMISSION_DENIED, ErrorCode::kPermissionDenied},
        {grpc::StatusCode::UNAUTHENTICATED, ErrorCode::kUnauthenticated},
        {grpc::StatusCode::FAILED_PRECONDITION, ErrorCode::kFailedPrecondition},
        {grpc::StatusCode::RESOURCE_EXHAUSTED, ErrorCode::kResourceExhausted},
        {grpc::StatusCode::UNAVAILABLE, ErrorCode::kUnavailable},
        {grpc::StatusCode::DEADLINE_EXCEEDED, ErrorCode::kDeadlineExceeded},
        {grpc::StatusCode::CANCELLED, ErrorCode::kCancelled},
        {grpc::StatusCode::DATA_LOSS, ErrorCode::kDataLoss},
        {grpc::StatusCode::UNIMPLEMENTED, ErrorCode::kUnimplemented},
        {grpc::StatusCode::UNKNOWN, ErrorCode::kInternal},
    };
    for (const auto& [status, kind] : kinds) {
        const Error error = FromStatus({status, "first\nsecond"}, "farm:7878");
        EXPECT_EQ(error.code(), kind);
        EXPECT_THAT(error.what(), testing::Not(testing::HasSubstr("\n")));
    }
}

TEST(FromStatus, AServerOutOfReachIsNamed) {
    EXPECT_THAT(FromStatus({grpc::StatusCode::UNAVAILABLE, "refused"}, "farm:7878").what(),
                testing::HasSubstr("farm:7878"));
}

}  // namespace
}  // namespace relume::codec
