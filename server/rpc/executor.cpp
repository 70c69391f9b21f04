#include "server/rpc/executor.h"

#include <sys/resource.h>

#include <exception>
#include <utility>

#include "core/base/log.h"

namespace relume::server {

SerialExecutor::SerialExecutor(std::string name, int niceness)
    : name_(std::move(name)), niceness_(niceness), thread_([this] { Run(); }) {}

SerialExecutor::~SerialExecutor() {
    {
        const std::lock_guard lock(mutex_);
        ending_ = true;
    }
    posted_.notify_all();
    thread_.join();
}

void SerialExecutor::Post(std::function<void()> task) {
    {
        const std::lock_guard lock(mutex_);
        tasks_.push_back(std::move(task));
    }
    posted_.notify_all();
}

std::size_t SerialExecutor::waiting() const {
    const std::lock_guard lock(mutex_);
    return tasks_.size();
}

void SerialExecutor::Every(Duration period, std::function<void()> task) {
    {
        const std::lock_guard lock(mutex_);
        period_ = period;
        periodic_ = std::move(task);
    }
    posted_.notify_all();
}

void SerialExecutor::Run() {
    const SteadyClock clock;
    const auto run = [this](const std::function<void()>& task) {
        try {
            task();
        } catch (const std::exception& error) {
            spdlog::error("{}: {}", name_, error.what());
        }
    };
    if (niceness_ != 0) {
        // On Linux it is the calling thread's alone. If it can't be, it is as nice as the others.
        const int own = getpriority(PRIO_PROCESS, 0);
        setpriority(PRIO_PROCESS, 0, own + niceness_);
    }
    TimePoint next = clock.Now();
    std::unique_lock lock(mutex_);
    for (;;) {
        const auto wake = [this] { return !tasks_.empty() || ending_; };
        if (!periodic_) {
            posted_.wait(lock, [&] { return wake() || periodic_; });
        } else if (!posted_.wait_until(lock, next, wake) || clock.Now() >= next) {
            lock.unlock();
            run(periodic_);
            next = clock.Now() + period_;
            lock.lock();
        }
        if (!tasks_.empty()) {
            {
                // The task dies before the lock is taken: what it owns may post as well.
                const std::function<void()> task = std::move(tasks_.front());
                tasks_.pop_front();
                lock.unlock();
                run(task);
            }
            lock.lock();
        } else if (ending_) {
            return;
        }
    }
}

}  // namespace relume::server
