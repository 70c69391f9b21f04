#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "core/base/clock.h"

namespace relume::server {

// Runs tasks one after the other on a thread of its own, so that threads of gRPC never wait. A task
// that throws is logged and forgotten.
class SerialExecutor {
  public:
    // `niceness`: as much less of a core than the process's other threads, where they compete.
    explicit SerialExecutor(std::string name, int niceness = 0);
    static constexpr int kBackground = 10;
    // Runs what was posted so far, also by those tasks, and ends.
    ~SerialExecutor();
    SerialExecutor(const SerialExecutor&) = delete;
    SerialExecutor& operator=(const SerialExecutor&) = delete;

    // Thread-safe.
    void Post(std::function<void()> task);
    // Tasks that were posted and have not begun. Thread-safe.
    std::size_t waiting() const;
    // Calls `task` again and again between the others, about every `period`. Once, before any Post.
    void Every(Duration period, std::function<void()> task);

  private:
    void Run();

    std::string name_;
    const int niceness_;
    mutable std::mutex mutex_;  // guards all below but the thread
    std::condition_variable posted_;
    std::deque<std::function<void()>> tasks_;
    std::function<void()> periodic_;
    Duration period_{};
    bool ending_ = false;
    std::thread thread_;
};

}  // namespace relume::server
