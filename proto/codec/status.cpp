#include "proto/codec/status.h"

#include <fmt/format.h>

#include <algorithm>

namespace relume::codec {
namespace {

ErrorCode KindOf(grpc::StatusCode code) {
    switch (code) {
        case grpc::StatusCode::INVALID_ARGUMENT:
        case grpc::StatusCode::OUT_OF_RANGE:
            return ErrorCode::kInvalidArgument;
        case grpc::StatusCode::NOT_FOUND:
            return ErrorCode::kNotFound;
        case grpc::StatusCode::ALREADY_EXISTS:
            return ErrorCode::kAlreadyExists;
        case grpc::StatusCode::PERMISSION_DENIED:
            return ErrorCode::kPermissionDenied;
        case grpc::StatusCode::UNAUTHENTICATED:
            return ErrorCode::kUnauthenticated;
        case grpc::StatusCode::FAILED_PRECONDITION:
            return ErrorCode::kFailedPrecondition;
        case grpc::StatusCode::RESOURCE_EXHAUSTED:
            return ErrorCode::kResourceExhausted;
        case grpc::StatusCode::UNAVAILABLE:
            return ErrorCode::kUnavailable;
        case grpc::StatusCode::DEADLINE_EXCEEDED:
            return ErrorCode::kDeadlineExceeded;
        case grpc::StatusCode::CANCELLED:
            return ErrorCode::kCancelled;
        case grpc::StatusCode::DATA_LOSS:
            return ErrorCode::kDataLoss;
        case grpc::StatusCode::UNIMPLEMENTED:
            return ErrorCode::kUnimplemented;
        default:
            return ErrorCode::kInternal;
    }
}

}  // namespace

Error FromStatus(const grpc::Status& status, const std::string& server) {
    std::string reason = status.error_message();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    switch (KindOf(status.error_code())) {
        case ErrorCode::kUnavailable:
            return {
                ErrorCode::kUnavailable,
                fmt::format("{}: can't be reached; check the address and that relume-server runs "
                            "there ({})",
                            server, reason)};
        case ErrorCode::kDeadlineExceeded:
            return {
                ErrorCode::kDeadlineExceeded,
                fmt::format("{}: no answer in time; check the address and the network", server)};
        case ErrorCode::kUnimplemented:
            return {ErrorCode::kUnimplemented,
                    fmt::format("{}: is not a Relume server of this version ({})", server, reason)};
        case ErrorCode::kPermissionDenied:
        case ErrorCode::kUnauthenticated:
        case ErrorCode::kInternal:
            return {KindOf(status.error_code()), fmt::format("{}: {}", server, reason)};
        default:
            return {KindOf(status.error_code()), reason};
    }
}

}  // namespace relume::codec
