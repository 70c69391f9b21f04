#pragma once

#include <sys/types.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace relume::client {

// A program that runs beside this one, in a process group of its own so that Ctrl-C reaches this
// one alone, and without RELUME_TLS_* and RELUME_JOIN_TOKEN. Start children before gRPC is used in
// the process. Thread-safe.
class ChildProcess {
  public:
    // `show_log`: its stderr is this process's; else the last lines are kept for LastWords.
    // Throws kNotFound if the program can't be started.
    ChildProcess(const std::string& program, const std::vector<std::string>& arguments,
                 bool show_log);
    ~ChildProcess();  // Terminate(1)

    pid_t pid() const { return pid_; }
    // The next line of its stdout; nothing if it ended or the time was up.
    std::optional<std::string> ReadLine(double seconds);
    // True once it has ended.
    bool Ended();
    // "ended with exit code 1: <last line of its stderr>"
    std::string LastWords();
    // SIGTERM; SIGKILL if it is still there after `seconds`. Waits for its end.
    void Terminate(double seconds);
    void Signal(int signal);

  private:
    void ReadThread();
    bool Reap(bool wait);

    pid_t pid_ = -1;
    int out_ = -1, err_ = -1;
    std::thread reader_;

    std::mutex mutex_;  // guards all below
    std::condition_variable changed_;
    std::deque<std::string> lines_;  // of stdout, not yet read
    std::deque<std::string> log_;    // last lines of stderr
    bool closed_ = false;            // both pipes have ended
    std::optional<int> status_;      // of waitpid
};

// The program `name` in the folder of this one.
std::string ProgramBeside(const std::string& name);

}  // namespace relume::client
