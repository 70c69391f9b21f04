#include "core/base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

#include "core/base/cancel_token.h"
#include "core/base/clock.h"
#include "core/base/error.h"

namespace relume {
namespace {

TEST(ParallelFor, VisitsEachItemOnce) {
    for (const std::size_t count : {1u, 2u, 7u, 1000u, 10007u}) {
        for (const std::size_t grain : {0u, 1u, 64u, 100000u}) {
            std::vector<std::atomic<int>> visits(count + 5);
            ParallelFor(5, count + 5, grain, [&](std::size_t i0, std::size_t i1) {
                EXPECT_LT(i0, i1);
                for (std::size_t i = i0; i < i1; ++i) {
                    ++visits[i];
                }
            });
            for (std::size_t i = 0; i < visits.size(); ++i) {
                ASSERT_EQ(visits[i], i < 5 ? 0 : 1) << i << " of " << count << ", grain " << grain;
            }
        }
    }
}

TEST(ParallelFor, AnEmptyRangeCallsNothing) {
    ParallelFor(3, 3, 1, [](std::size_t, std::size_t) { FAIL(); });
    ParallelFor(4, 3, 1, [](std::size_t, std::size_t) { FAIL(); });
}

TEST(ParallelFor, ExceptionsReachTheCaller) {
    EXPECT_THROW(ParallelFor(0, 100, 1,
                             [](std::size_t i0, std::size_t) {
                                 if (i0 >= 50) {
                                     ThrowInvalidArgument("item");
                                 }
                             }),
                 Error);
}

TEST(ParallelFor, MayBeNested) {
    std::atomic<int> sum{0};
    ParallelFor(0, 10, 1, [&](std::size_t i0, std::size_t i1) {
        for (std::size_t i = i0; i < i1; ++i) {
            ParallelFor(0, 10, 1,
                        [&](std::size_t j0, std::size_t j1) { sum += static_cast<int>(j1 - j0); });
        }
    });
    EXPECT_EQ(sum, 100);
}

TEST(ThreadCount, IsWhatWasSet) {
    SetThreadCount(3);
    EXPECT_EQ(ThreadCount(), 3);
    SetThreadCount(1);
    EXPECT_EQ(ThreadCount(), 1);
    SetThreadCount(0);
    EXPECT_GE(ThreadCount(), 1);
}

TEST(CancelToken, StaysCancelled) {
    CancelToken token;
    EXPECT_FALSE(token.cancelled());
    token.Cancel();
    token.Cancel();
    EXPECT_TRUE(token.cancelled());
}

TEST(Clock, SecondsRoundTripAndTimeDoesNotGoBack) {
    EXPECT_EQ(ToSeconds(FromSeconds(1.5)), 1.5);
    EXPECT_EQ(FromSeconds(0.25), std::chrono::milliseconds(250));
    const SteadyClock clock;
    const TimePoint before = clock.Now();
    EXPECT_LE(before, clock.Now());
}

}  // namespace
}  // namespace relume
