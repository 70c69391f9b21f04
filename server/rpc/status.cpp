#include "server/rpc/status.h"

#include <google/protobuf/any.pb.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <new>
#include <string>

#include "core/base/log.h"
#include "relume/v1/types.pb.h"

namespace relume::server {
namespace {

// Headers hold 8 KiB in all, and the message goes into them twice.
constexpr std::size_t kMaxMessage = 2000;

grpc::StatusCode CodeOf(ErrorCode code) {
    switch (code) {
        case ErrorCode::kInvalidArgument:
            return grpc::StatusCode::INVALID_ARGUMENT;
        case ErrorCode::kNotFound:
            return grpc::StatusCode::NOT_FOUND;
        case ErrorCode::kAlreadyExists:
            return grpc::StatusCode::ALREADY_EXISTS;
        case ErrorCode::kPermissionDenied:
            return grpc::StatusCode::PERMISSION_DENIED;
        case ErrorCode::kUnauthenticated:
            return grpc::StatusCode::UNAUTHENTICATED;
        case ErrorCode::kFailedPrecondition:
            return grpc::StatusCode::FAILED_PRECONDITION;
        case ErrorCode::kResourceExhausted:
            return grpc::StatusCode::RESOURCE_EXHAUSTED;
        case ErrorCode::kUnavailable:
            return grpc::StatusCode::UNAVAILABLE;
        case ErrorCode::kDeadlineExceeded:
            return grpc::StatusCode::DEADLINE_EXCEEDED;
        case ErrorCode::kCancelled:
            return grpc::StatusCode::CANCELLED;
        case ErrorCode::kDataLoss:
            return grpc::StatusCode::DATA_LOSS;
        case ErrorCode::kUnimplemented:
            return grpc::StatusCode::UNIMPLEMENTED;
        case ErrorCode::kInternal:
            break;
    }
    return grpc::StatusCode::INTERNAL;
}

// google.rpc.Status { int32 code = 1; string message = 2; repeated google.protobuf.Any details = 3;
// }, which has no generated code in Debian.
std::string EncodeDetails(grpc::StatusCode code, const std::string& message, const char* reason) {
    v1::ErrorDetail detail;
    detail.set_reason(reason);
    detail.set_message(message);
    google::protobuf::Any any;
    any.PackFrom(detail);
    using google::protobuf::internal::WireFormatLite;
    std::string bytes;
    {
        google::protobuf::io::StringOutputStream stream(&bytes);
        google::protobuf::io::CodedOutputStream out(&stream);
        WireFormatLite::WriteInt32(1, static_cast<int>(code), &out);
        WireFormatLite::WriteString(2, message, &out);
        WireFormatLite::WriteBytes(3, any.SerializeAsString(), &out);
    }
    return bytes;
}

}  // namespace

grpc::Status ToStatus(const Error& error) {
    std::string message = std::string(error.what()).substr(0, kMaxMessage);
    // Messages repeat what a request held: only what is printable goes into a header and on to a
    // terminal.
    std::replace_if(
        message.begin(), message.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    const grpc::StatusCode code = CodeOf(error.code());
    return {code, message, EncodeDetails(code, message, ToString(error.code()))};
}

grpc::Status Guard(const std::function<void()>& body) {
    try {
        body();
        return grpc::Status::OK;
    } catch (const Error& error) {
        return ToStatus(error);
    } catch (const std::bad_alloc&) {
        return ToStatus(
            Error(ErrorCode::kResourceExhausted, "the server is out of memory; try again later"));
    } catch (const std::exception& error) {
        spdlog::error("unexpected: {}", error.what());
        return ToStatus(
            Error(ErrorCode::kInternal, std::string("the server failed: ") + error.what()));
    }
}

}  // namespace relume::server
