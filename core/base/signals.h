#pragma once

#include <functional>
#include <thread>

namespace relume {

// Turns SIGINT and SIGTERM into calls of a function on a thread of its own, where it may do
// anything. Make it at the start of main(), before any other thread: they inherit that the signals
// are blocked.
class SignalWatcher {
  public:
    // `on_signal` gets the signal's number, and is called again for each further one.
    explicit SignalWatcher(std::function<void(int)> on_signal);
    ~SignalWatcher();
    SignalWatcher(const SignalWatcher&) = delete;
    SignalWatcher& operator=(const SignalWatcher&) = delete;

  private:
    std::function<void(int)> on_signal_;
    int stop_pipe_[2];
    std::thread thread_;
};

// Has the kernel send `signal` to this process when the one that started it ends. `parent` is that
// one's pid, by which it is seen that it ended before this call: this process then ends, too. 1 or
// less: not known. Call at the start of main().
void EndWithParent(int signal, int parent);

}  // namespace relume
