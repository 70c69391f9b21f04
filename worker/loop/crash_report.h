#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <thread>

namespace relume::worker {

// What a thread was at when it crashed.
struct Crash {
    int signal = 0;
    std::string job;          // "": not known
    std::uint64_t lease = 0;  // 0: it was loading the scene
};

// For as long as it lives this thread is at work on a lease, or, with 0, loads the scene of a job.
// A stack of its own for the signal handler is made with the first one of each thread: so an
// overflow of the stack is told, too.
class CrashScope {
  public:
    CrashScope(const std::string& job, std::uint64_t lease);
    ~CrashScope();
    CrashScope(const CrashScope&) = delete;
    CrashScope& operator=(const CrashScope&) = delete;
};

// While it lives, a fault of this process (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT) is told
// before the process dies of it: the thread that crashed waits, a second at most, while another
// one says the last words. Nobody is told if a sanitizer or a debugger has its own handler. One at
// a time in a process.
class CrashReporter {
  public:
    // `last_words` is called once, on a thread of its own. Locks that the thread that crashed holds
    // stay locked.
    explicit CrashReporter(std::function<void(const Crash&)> last_words);
    ~CrashReporter();
    CrashReporter(const CrashReporter&) = delete;
    CrashReporter& operator=(const CrashReporter&) = delete;

  private:
    std::thread thread_;
};

}  // namespace relume::worker
