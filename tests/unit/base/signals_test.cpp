#include "core/base/signals.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <condition_variable>
#include <csignal>
#include <cstdlib>
#include <mutex>
#include <vector>

namespace relume {
namespace {

// Exit code 0 if each signal arrives and the watcher ends, also one that has seen none.
[[noreturn]] void Watch() {
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
            kill(getpid(), signal);
            changed.wait(lock, [&] { return seen.size() > before; });
        }
    }
    {
        const SignalWatcher idle([](int) { std::_Exit(2); });
    }
    std::_Exit(seen == std::vector<int>{SIGTERM, SIGINT, SIGTERM} ? 0 : 1);
}

TEST(SignalWatcher, PassesOnEachSignalAndEndsWithout) {
    // In a process of its own: threads that other tests have made do not block the signals.
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    EXPECT_EXIT(Watch(), testing::ExitedWithCode(0), "");
}

// Ends with 0 if EndWithParent lets it.
[[noreturn]] void StayWith(int parent) {
    EndWithParent(SIGKILL, parent);
    std::_Exit(0);
}

TEST(EndWithParent, EndsAtOnceIfTheParentIsGone) {
    GTEST_FLAG_SET(death_test_style, "fast");
    const int parent = getpid();  // of the processes that EXPECT_EXIT makes
    EXPECT_EXIT(StayWith(parent), testing::ExitedWithCode(0), "");
    EXPECT_EXIT(StayWith(1), testing::ExitedWithCode(0), "");  // not known
    EXPECT_EXIT(StayWith(parent + 1), testing::ExitedWithCode(1), "");
}

}  // namespace
}  // namespace relume
