#include "worker/loop/crash_report.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstring>
#include <memory>
#include <utility>

#include "core/base/error.h"

namespace relume::worker {
namespace {

constexpr std::array kSignals{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
constexpr int kPatienceMilliseconds = 1000;
constexpr std::size_t kStackBytes = 64 << 10;

// Fixed in size: written by a signal handler, which may not allocate.
struct Record {
    int signal = 0;
    std::uint64_t lease = 0;
    char job[128] = "";
};
static_assert(sizeof(Record) < 512, "a pipe takes it at once");

thread_local Record here;  // what this thread is at

int record_pipe[2] = {-1, -1}, said_pipe[2] = {-1, -1};
std::atomic_flag crashed;
std::array<struct sigaction, kSignals.size()> before;
std::array<bool, kSignals.size()> taken;

void OnCrash(int signal) {
    if (crashed.test_and_set()) {
        // A second thread crashes: the first one ends the process. If it is the one that says the
        // last words, the first one stops waiting.
        for (;;) {
            pause();
        }
    }
    Record record = here;
    record.signal = signal;
    if (write(record_pipe[1], &record, sizeof record) == sizeof record) {
        pollfd said{said_pipe[0], POLLIN, 0};
        poll(&said, 1, kPatienceMilliseconds);
    }
    // What it would have done without us: it waits until this handler returns.
    std::signal(signal, SIG_DFL);
    raise(signal);
}

// The alternate stack of this thread, until it ends.
class SignalStack {
  public:
    SignalStack() : memory_(new char[kStackBytes]) {
        stack_t stack{};
        stack.ss_sp = memory_.get();
        stack.ss_size = kStackBytes;
        made_ = sigaltstack(&stack, &before_) == 0;
    }
    ~SignalStack() {
        if (made_) {
            sigaltstack(&before_, nullptr);
        }
    }
    SignalStack(const SignalStack&) = delete;
    SignalStack& operator=(const SignalStack&) = delete;

  private:
    std::unique_ptr<char[]> memory_;
    stack_t before_{};
    bool made_ = false;
};

}  // namespace

CrashScope::CrashScope(const std::string& job, std::uint64_t lease) {
    thread_local const SignalStack stack;
    here.lease = lease;
    const std::size_t length = std::min(job.size(), sizeof here.job - 1);
    std::memcpy(here.job, job.data(), length);
    here.job[length] = '\0';
}

CrashScope::~CrashScope() { here = Record(); }

CrashReporter::CrashReporter(std::function<void(const Crash&)> last_words) {
    if (pipe2(record_pipe, O_CLOEXEC) != 0 || pipe2(said_pipe, O_CLOEXEC) != 0) {
        throw Error(ErrorCode::kInternal, "can't watch for crashes: too many open files");
    }
    thread_ = std::thread([last_words = std::move(last_words)] {
        Record record;
        if (read(record_pipe[0], &record, sizeof record) != sizeof record) {
            return;  // closed: nothing happened
        }
        last_words({record.signal, record.job, record.lease});
        const char said = 1;
        [[maybe_unused]] const auto done = write(said_pipe[1], &said, 1);
    });
    struct sigaction action {};
    action.sa_handler = OnCrash;
    action.sa_flags = SA_ONSTACK;
    sigemptyset(&action.sa_mask);
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
        taken[i] = sigaction(kSignals[i], nullptr, &before[i]) == 0 &&
                   before[i].sa_handler == SIG_DFL && sigaction(kSignals[i], &action, nullptr) == 0;
    }
}

CrashReporter::~CrashReporter() {
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
        if (taken[i]) {
            sigaction(kSignals[i], &before[i], nullptr);
        }
    }
    close(record_pipe[1]);
    thread_.join();
    for (const int fd : {record_pipe[0], said_pipe[0], said_pipe[1]}) {
        close(fd);
    }
}

}  // namespace relume::worker
