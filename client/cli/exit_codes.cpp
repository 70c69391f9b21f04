#include "client/cli/exit_codes.h"

namespace relume::client {

std::string DescribeExitCodes() {
    return "0     done: what was asked for is there\n"
           "1     another failure\n"
           "2     the command line: an option, a size, a sampler or a filter that is not known\n"
           "3     a scene or an image can't be read or rendered\n"
           "4     the server is out of reach or lets us not in, or the local farm does not start "
           "or breaks "
           "down\n"
           "5     the job failed, was cancelled, is not over, or is not there\n"
           "6     the result can't be written\n"
           "7     verify: an image's claim of its error does not hold\n"
           "130   interrupted by Ctrl-C (SIGINT); 143: by SIGTERM\n";
}

int ExitCodeOf(const std::exception& error) {
    if (const auto* command = dynamic_cast<const CommandError*>(&error)) {
        return command->exit_code();
    }
    if (dynamic_cast<const OutputError*>(&error) != nullptr) {
        return kExitOutput;
    }
    const auto* known = dynamic_cast<const Error*>(&error);
    if (known == nullptr) {
        return kExitFailure;
    }
    switch (known->code()) {
        case ErrorCode::kInvalidArgument:
            return kExitUsage;
        case ErrorCode::kPermissionDenied:
        case ErrorCode::kUnauthenticated:
        case ErrorCode::kUnavailable:
        case ErrorCode::kDeadlineExceeded:
        case ErrorCode::kUnimplemented:
            return kExitServer;
        case ErrorCode::kNotFound:
        case ErrorCode::kFailedPrecondition:
            return kExitJob;
        default:
            return kExitFailure;
    }
}

}  // namespace relume::client
