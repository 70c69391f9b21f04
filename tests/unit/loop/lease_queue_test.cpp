#include "worker/loop/lease_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

namespace relume::worker {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

HeldLease Lease(std::uint64_t id, const std::string& job = "jobs/a") {
    HeldLease lease;
    lease.id = id;
    lease.job = job;
    return lease;
}

const auto kScene = std::make_shared<const LoadedScene>();

TEST(LeaseQueue, FirstComeFirstBegunOnceTheSceneIsThere) {
    LeaseQueue queue;
    queue.Push(Lease(1, "jobs/a"));
    queue.Push(Lease(2, "jobs/b"));
    queue.Push(Lease(3, "jobs/b"));
    queue.SetScene("jobs/b", kScene);
    EXPECT_EQ(queue.Take()->id, 2u);
    queue.SetScene("jobs/a", kScene);
    EXPECT_EQ(queue.Take()->id, 1u);
    EXPECT_EQ(queue.Take()->id, 3u);
    EXPECT_EQ(queue.held(), 3u);  // running ones, too
}

TEST(LeaseQueue, TakeWaitsForASceneAndEndsWhenClosed) {
    LeaseQueue queue;
    std::vector<std::uint64_t> taken;
    std::thread renderer([&] {
        while (auto lease = queue.Take()) {
            taken.push_back(lease->id);
            queue.Finish(*lease);
        }
    });
    queue.Push(Lease(7));
    queue.SetScene("jobs/a", kScene);
    while (queue.held() > 0) {
        std::this_thread::yield();
    }
    queue.Close();
    renderer.join();
    EXPECT_THAT(taken, ElementsAre(7));
    EXPECT_FALSE(queue.Take().has_value());
}

TEST(LeaseQueue, DropTakesBackTheWaitingAndCancelsTheRunning) {
    LeaseQueue queue;
    for (const std::uint64_t id : {1, 2, 3, 4}) {
        queue.Push(Lease(id));
    }
    queue.SetScene("jobs/a", kScene);
    const auto running = queue.Take();
    EXPECT_THAT(queue.Drop({1, 3, 99}), ElementsAre(3));
    EXPECT_TRUE(running->cancel->cancelled());
    queue.Push(Lease(5, "jobs/b"));
    EXPECT_THAT(queue.DropJob("jobs/a"), UnorderedElementsAre(2, 4));
    EXPECT_THAT(queue.DropAll(), ElementsAre(5));
    EXPECT_THAT(queue.DropAll(), IsEmpty());
    EXPECT_EQ(queue.held(), 1u);
}

TEST(LeaseQueue, IdleOnceTheRunningHaveFinished) {
    LeaseQueue queue;
    EXPECT_TRUE(queue.WaitIdle(milliseconds(0)));
    queue.Push(Lease(1));
    queue.SetScene("jobs/a", kScene);
    EXPECT_TRUE(queue.WaitIdle(milliseconds(0)));  // waiting is not running
    const auto lease = queue.Take();
    EXPECT_FALSE(queue.WaitIdle(milliseconds(0)));
    queue.CancelRunning();
    EXPECT_TRUE(lease->cancel->cancelled());
    queue.Finish(*lease);
    EXPECT_TRUE(queue.WaitIdle(milliseconds(0)));
}

TEST(LeaseQueue, AnotherServersLeaseOfTheSameNumberIsAnother) {
    LeaseQueue queue;
    queue.Push(Lease(1));
    queue.SetScene("jobs/a", kScene);
    const auto old = queue.Take();
    queue.Push(Lease(1));  // after a reconnect
    queue.SetScene("jobs/a", kScene);
    const auto fresh = queue.Take();
    queue.Finish(*old);
    EXPECT_FALSE(queue.WaitIdle(milliseconds(0)));
    queue.CancelRunning();
    EXPECT_TRUE(fresh->cancel->cancelled());
    queue.Finish(*fresh);
    EXPECT_TRUE(queue.WaitIdle(milliseconds(0)));
}

}  // namespace
}  // namespace relume::worker
