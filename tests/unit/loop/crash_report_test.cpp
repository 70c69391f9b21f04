#include "worker/loop/crash_report.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <thread>

namespace relume::worker {
namespace {

bool HandlersAreFree() {
    struct sigaction action {};
    sigaction(SIGSEGV, nullptr, &action);
    return action.sa_handler == SIG_DFL;
}

// In a process of its own: a thread at work on `lease` of jobs/a does `crash`.
template <typename F>
void CrashAt(std::uint64_t lease, F crash) {
    const CrashReporter reporter([](const Crash& told) {
        const auto line =
            fmt::format("signal {} in '{}' lease {}\n", told.signal, told.job, told.lease);
        std::fputs(line.c_str(), stderr);
        std::fflush(stderr);
    });
    std::thread([&] {
        const CrashScope scope("jobs/a", lease);
        crash();
    }).join();
    std::_Exit(0);
}

int Overflow(volatile char* before) {
    volatile char here[4096];
    here[0] = before[0];
    return here[0] == 0 ? Overflow(here) + here[0] : 1;  // never 1, which no compiler knows
}

class CrashReportDeathTest : public testing::Test {
  protected:
    void SetUp() override {
        testing::FLAGS_gtest_death_test_style = "threadsafe";
        if (!HandlersAreFree()) {
            GTEST_SKIP() << "a sanitizer has its own handler of crashes";
        }
    }
};

TEST_F(CrashReportDeathTest, TellsWhatTheThreadWasAtAndDiesOfTheSignal) {
    EXPECT_EXIT(CrashAt(7, [] { raise(SIGSEGV); }), testing::KilledBySignal(SIGSEGV),
                "signal 11 in 'jobs/a' lease 7");
    EXPECT_EXIT(CrashAt(0, [] { std::abort(); }), testing::KilledBySignal(SIGABRT),
                "signal 6 in 'jobs/a' lease 0");
}

TEST_F(CrashReportDeathTest, TellsOfAStackThatOverflows) {
    EXPECT_EXIT(CrashAt(9,
                        [] {
                            volatile char first = 0;
                            std::exit(Overflow(&first));
                        }),
                testing::KilledBySignal(SIGSEGV), "signal 11 in 'jobs/a' lease 9");
}

TEST_F(CrashReportDeathTest, AThreadThatIsAtNothingIsToldWithoutAJob) {
    EXPECT_EXIT(
        {
            const CrashReporter reporter([](const Crash& told) {
                std::fputs(told.job.empty() ? "nothing known\n" : "wrong\n", stderr);
            });
            { const CrashScope over("jobs/a", 1); }
            raise(SIGFPE);
        },
        testing::KilledBySignal(SIGFPE), "nothing known");
}

TEST_F(CrashReportDeathTest, LastWordsThatDoNotEndAreNotWaitedFor) {
    EXPECT_EXIT(
        {
            const CrashReporter reporter([](const Crash&) {
                for (;;) {
                    pause();
                }
            });
            raise(SIGBUS);
        },
        testing::KilledBySignal(SIGBUS), "");
}

TEST_F(CrashReportDeathTest, AfterItsEndNothingIsLeft) {
    {
        const CrashReporter reporter([](const Crash&) {});
    }
    EXPECT_TRUE(HandlersAreFree());
}

}  // namespace
}  // namespace relume::worker
