#include "client/lib/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "core/base/error.h"

extern char** environ;

namespace relume::client {
namespace {

constexpr std::size_t kKeptLogLines = 20;

// Cuts whole lines off the front of `buffer`.
template <typename Take>
void TakeLines(std::string* buffer, Take take) {
    for (std::size_t end; (end = buffer->find('\n')) != std::string::npos;) {
        take(buffer->substr(0, end));
        buffer->erase(0, end + 1);
    }
}

// Of this process, without what tells how to reach a server: the children of a local farm are told
// by their options alone.
std::vector<char*> ChildEnvironment() {
    std::vector<char*> kept;
    for (char** at = environ; *at != nullptr; ++at) {
        const std::string_view entry = *at;
        if (entry.rfind("RELUME_TLS_", 0) != 0 && entry.rfind("RELUME_JOIN_TOKEN=", 0) != 0) {
            kept.push_back(*at);
        }
    }
    kept.push_back(nullptr);
    return kept;
}

}  // namespace

ChildProcess::ChildProcess(const std::string& program, const std::vector<std::string>& arguments,
                           bool show_log) {
    int out[2], err[2] = {-1, -1};
    if (pipe2(out, O_CLOEXEC) != 0 || (!show_log && pipe2(err, O_CLOEXEC) != 0)) {
        throw Error(ErrorCode::kResourceExhausted, "too many open files");
    }
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    if (!show_log) {
        posix_spawn_file_actions_adddup2(&actions, err[1], STDERR_FILENO);
    }
    // Signals as in a fresh process, whatever this one blocks or ignores.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setflags(
        &attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);

    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const auto& argument : arguments) {
        argv.push_back(const_cast<char*>(argument.c_str()));
    }
    argv.push_back(nullptr);
    const int error = posix_spawn(&pid_, program.c_str(), &actions, &attributes, argv.data(),
                                  ChildEnvironment().data());
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    close(out[1]);
    if (err[1] >= 0) {
        close(err[1]);
    }
    out_ = out[0];
    err_ = err[0];
    if (error != 0) {
        close(out_);
        if (err_ >= 0) {
            close(err_);
        }
        ThrowNotFound(fmt::format("{}: can't be started: {}; install it beside relume", program,
                                  std::strerror(error)));
    }
    reader_ = std::thread([this] { ReadThread(); });
}

ChildProcess::~ChildProcess() {
    Terminate(1);
    reader_.join();
    close(out_);
    if (err_ >= 0) {
        close(err_);
    }
}

void ChildProcess::ReadThread() {
    std::string out, err;
    pollfd watched[2] = {{out_, POLLIN, 0}, {err_, POLLIN, 0}};  // a negative fd is passed over
    char buffer[4096];
    while (watched[0].fd >= 0 || watched[1].fd >= 0) {
        if (poll(watched, 2, -1) < 0) {
            continue;
        }
        for (int i = 0; i < 2; ++i) {
            if (watched[i].fd < 0 || watched[i].revents == 0) {
                continue;
            }
            const ssize_t n = read(watched[i].fd, buffer, sizeof buffer);
            if (n <= 0) {
                watched[i].fd = -1;
                continue;
            }
            (i == 0 ? out : err).append(buffer, static_cast<std::size_t>(n));
        }
        const std::lock_guard lock(mutex_);
        TakeLines(&out, [&](std::string line) { lines_.push_back(std::move(line)); });
        TakeLines(&err, [&](std::string line) {
            log_.push_back(std::move(line));
            if (log_.size() > kKeptLogLines) {
                log_.pop_front();
            }
        });
        changed_.notify_all();
    }
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
}

std::optional<std::string> ChildProcess::ReadLine(double seconds) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::duration<double>(seconds),
                      [&] { return !lines_.empty() || closed_; });
    if (lines_.empty()) {
        return std::nullopt;
    }
    std::string line = std::move(lines_.front());
    lines_.pop_front();
    return line;
}

bool ChildProcess::Reap(bool wait) {
    const std::lock_guard lock(mutex_);
    if (!status_) {
        int status = 0;
        pid_t result;
        do {
            result = waitpid(pid_, &status, wait ? 0 : WNOHANG);
        } while (result < 0 && errno == EINTR);
        if (result != 0) {
            status_ = result == pid_ ? status : 0;
        }
    }
    return status_.has_value();
}

bool ChildProcess::Ended() { return Reap(false); }

std::string ChildProcess::LastWords() {
    std::unique_lock lock(mutex_);
    // What it wrote last may still be on its way through the pipe.
    changed_.wait_for(lock, std::chrono::seconds(1), [&] { return closed_; });
    std::string text = "runs";
    if (status_ && WIFSIGNALED(*status_)) {
        text = fmt::format("was killed by signal {}", WTERMSIG(*status_));
    } else if (status_) {
        text = fmt::format("ended with exit code {}", WEXITSTATUS(*status_));
    }
    return log_.empty() ? text : text + ": " + log_.back();
}

void ChildProcess::Signal(int signal) {
    const std::lock_guard lock(mutex_);
    if (!status_) {
        kill(pid_, signal);
    }
}

void ChildProcess::Terminate(double seconds) {
    Signal(SIGTERM);
    const auto limit = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (!Reap(false)) {
        if (std::chrono::steady_clock::now() >= limit) {
            Signal(SIGKILL);
            Reap(true);
            break;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
}

std::string ProgramBeside(const std::string& name) {
    std::error_code error;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
    return (error ? std::filesystem::path(".") : self.parent_path()) / name;
}

}  // namespace relume::client
