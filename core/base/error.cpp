#include "core/base/error.h"

#include <algorithm>

namespace relume {

const char* ToString(ErrorCode code) {
    switch (code) {
        case ErrorCode::kInvalidArgument:
            return "INVALID_ARGUMENT";
        case ErrorCode::kNotFound:
            return "NOT_FOUND";
        case ErrorCode::kAlreadyExists:
            return "ALREADY_EXISTS";
        case ErrorCode::kPermissionDenied:
            return "PERMISSION_DENIED";
        case ErrorCode::kUnauthenticated:
            return "UNAUTHENTICATED";
        case ErrorCode::kFailedPrecondition:
            return "FAILED_PRECONDITION";
        case ErrorCode::kResourceExhausted:
            return "RESOURCE_EXHAUSTED";
        case ErrorCode::kUnavailable:
            return "UNAVAILABLE";
        case ErrorCode::kDeadlineExceeded:
            return "DEADLINE_EXCEEDED";
        case ErrorCode::kCancelled:
            return "CANCELLED";
        case ErrorCode::kDataLoss:
            return "DATA_LOSS";
        case ErrorCode::kUnimplemented:
            return "UNIMPLEMENTED";
        case ErrorCode::kInternal:
            return "INTERNAL";
    }
    return "INTERNAL";
}

std::string Printable(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 127; }, '?');
    return text;
}

void ThrowInvalidArgument(const std::string& message) {
    throw Error(ErrorCode::kInvalidArgument, message);
}

void ThrowNotFound(const std::string& message) { throw Error(ErrorCode::kNotFound, message); }

}  // namespace relume
