#pragma once

#include <exception>
#include <string>

#include "client/lib/output_file.h"
#include "core/base/error.h"

namespace relume::client {

// What the process answers with. docs/commands.md and `relume help exit-codes` say the same.
enum ExitCode {
    kExitDone = 0,
    kExitFailure = 1,  // none of the others
    kExitUsage = 2,    // the command line
    kExitInput = 3,    // a scene or image that can't be read or rendered
    kExitServer = 4,   // server out of reach, local farm does not start or breaks down
    kExitJob = 5,      // the job failed, was cancelled, or is not there
    kExitOutput = 6,   // the result can't be written
    kExitClaim = 7,    // verify: the image is not as close as it claims
    kExitSignal = 128  // plus the number of the signal that ended it
};

// The text of `relume help exit-codes`.
std::string DescribeExitCodes();

// An error whose exit code is known where it happens.
class CommandError : public Error {
  public:
    CommandError(ExitCode exit_code, const std::string& message)
        : Error(ErrorCode::kInternal, message), exit_code_(exit_code) {}

    ExitCode exit_code() const { return exit_code_; }

  private:
    ExitCode exit_code_;
};

// Calls `body`; an Error that leaves it becomes a CommandError of this exit code, unless it is one
// already or about the output or an interruption.
template <typename Body>
auto WithExitCode(ExitCode exit_code, Body body) -> decltype(body()) {
    try {
        return body();
    } catch (const CommandError&) {
        throw;
    } catch (const OutputError&) {
        throw;
    } catch (const Error& error) {
        if (error.code() == ErrorCode::kCancelled) {
            throw;
        }
        throw CommandError(exit_code, error.what());
    }
}

// The exit code of an error that nobody gave one.
int ExitCodeOf(const std::exception& error);

}  // namespace relume::client
