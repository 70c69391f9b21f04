#include "core/base/signals.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <condition_variable>
#include <csignal>
#include <mutex>
#include <vector>

namespace relume {
namespace {

TEST(SignalWatcher, PassesOnEachSignalAndEndsWithout) {
    std::mutex mutex;
    std::condition_variable changed;
    std::vector<int> seen;
    {
        const SignalWatcher watcher([&](int signal) {
            const std::lock_guard lock(mutex);
            seen.push_back(signal);
            changed.notify_all();
        });
        for (const int signal : {SIGTERM, SIGINT, SIGTERM}) {
            std::unique_lock lock(mutex);
            const std::size_t before = seen.size();
            ASSERT_EQ(kill(getpid(), signal), 0);
            changed.wait(lock, [&] { return seen.size() > before; });
            EXPECT_EQ(seen.back(), signal);
        }
    }
    EXPECT_EQ(seen.size(), 3u);
    // Not even one signal is needed for it to end.
    const SignalWatcher idle([](int) { FAIL(); });
}

}  // namespace
}  // namespace relume
