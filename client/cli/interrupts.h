#pragma once

#include <functional>
#include <mutex>

#include "core/base/signals.h"

namespace relume::client {

// SIGINT and SIGTERM of the process. While a command has something to put in order, its Guard is
// told of the first signal; without one, and at the second signal, the process ends at once. Make
// it first in main(). Thread-safe.
class Interrupts {
  public:
    Interrupts();

    // The signal that came, 0 if none has.
    int signal() const;
    // Throws kCancelled if one has come.
    void Check() const;

    // Calls a function when a signal comes, or now if one has come; on another thread. Guards are
    // nested: the newest is called.
    class Guard {
      public:
        explicit Guard(
            Interrupts* interrupts, std::function<void()> on_signal = [] {});
        ~Guard();
        Guard(const Guard&) = delete;
        Guard& operator=(const Guard&) = delete;

      private:
        Interrupts* interrupts_;
        std::function<void()> on_signal_;
        Guard* outer_;
        friend class Interrupts;
    };

  private:
    void OnSignal(int signal);

    mutable std::mutex mutex_;  // guards all below; held while a guard is called
    int signal_ = 0;
    Guard* guard_ = nullptr;

    SignalWatcher watcher_;  // last: its thread uses the rest
};

}  // namespace relume::client
