#include "client/cli/replace_process.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#include "client/lib/child_process.h"
#include "core/base/error.h"

namespace relume::client {

void ReplaceProcess(const std::string& name, const std::vector<std::string>& arguments) {
    const std::string program = ProgramBeside(name);
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const auto& argument : arguments) {
        argv.push_back(const_cast<char*>(argument.c_str()));
    }
    argv.push_back(nullptr);
    std::fflush(stdout);
    // Signals as in a fresh process: this one watches SIGINT and SIGTERM and ignores SIGPIPE.
    std::signal(SIGPIPE, SIG_DFL);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    execv(program.c_str(), argv.data());
    const int error = errno;
    ThrowNotFound(fmt::format("{}: can't be started: {}; install it beside relume", program,
                              std::strerror(error)));
}

}  // namespace relume::client
