#pragma once

#include <atomic>

namespace relume {

// Set once by one thread, polled by others. Thread-safe; outlives whoever polls it.
class CancelToken {
  public:
    void Cancel() { cancelled_.store(true, std::memory_order_relaxed); }
    bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }

  private:
    std::atomic<bool> cancelled_{false};
};

}  // namespace relume
