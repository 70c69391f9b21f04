#pragma once

#include <stdexcept>
#include <string>

namespace relume {

// Kinds of failure, with the meaning of the gRPC status of the same name.
enum class ErrorCode {
    kInvalidArgument,
    kNotFound,
    kAlreadyExists,
    kPermissionDenied,
    kUnauthenticated,
    kFailedPrecondition,
    kResourceExhausted,
    kUnavailable,
    kDeadlineExceeded,
    kCancelled,
    kDataLoss,
    kUnimplemented,
    kInternal,
};

// "INVALID_ARGUMENT", ...
const char* ToString(ErrorCode code);

// The one exception that libraries throw. `what()` is a single line for a person: what is wrong,
// where (file, and line or byte where known) and what to do about it.
class Error : public std::runtime_error {
  public:
    Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}

    ErrorCode code() const { return code_; }

  private:
    ErrorCode code_;
};

// Somebody's text for such a line, which ends at a NUL: control characters become "?".
std::string Printable(std::string text);

[[noreturn]] void ThrowInvalidArgument(const std::string& message);
[[noreturn]] void ThrowNotFound(const std::string& message);

}  // namespace relume
