// Who is served first: by priority, then evenly among owners, in core-seconds.
#include "server/jobs/fair_share.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/base/error.h"
#include "tests/unit/jobs/shared_farm.h"

namespace relume::jobs {
namespace {

using testing::Each;
using testing::ElementsAre;

constexpr double kStay = 5;  // seconds that a worker stays with an owner

std::vector<std::uint64_t> Order(FairShare* share, const FairShare::Key* last = nullptr) {
    std::vector<std::uint64_t> order;
    share->Each(last, [&](const FairShare::Jobs& jobs) {
        order.insert(order.end(), jobs.started.begin(), jobs.started.end());
        order.insert(order.end(), jobs.waiting.begin(), jobs.waiting.end());
        return false;
    });
    return order;
}

TEST(FairShare, PriorityFirstThenTheLowestAccountThenAge) {
    FairShare share;
    share.Put(1, {0, "a"}, true);
    share.Put(2, {0, "b"}, true);
    share.Put(3, {0, "b"}, false);
    share.Put(4, {7, "c"}, false);
    share.Put(5, {-1, "a"}, true);
    EXPECT_THAT(Order(&share), ElementsAre(4, 1, 2, 3, 5));
    share.Lend({{0, "a"}, 2});
    EXPECT_THAT(Order(&share), ElementsAre(4, 2, 3, 1, 5));
    share.Use(2, {0, "b"}, 3, {});
    EXPECT_THAT(Order(&share), ElementsAre(4, 1, 2, 3, 5));
    share.Return({{0, "a"}, 2});
    share.Use(1, {0, "a"}, 4, {});
    EXPECT_THAT(Order(&share), ElementsAre(4, 2, 3, 1, 5));
    share.Put(3, {9, "b"}, false);  // another priority
    EXPECT_THAT(Order(&share), ElementsAre(3, 4, 2, 1, 5));
    share.Remove(2);
    EXPECT_THAT(Order(&share), ElementsAre(3, 4, 1, 5));
}

TEST(FairShare, AWorkerStaysUntilItsOwnerIsTooFarAhead) {
    FairShare share;
    share.SetSlack(10);
    const FairShare::Key a{0, "a"}, b{0, "b"};
    share.Put(1, a, true);
    share.Use(1, a, 20, {});
    share.Put(2, b, true);
    EXPECT_DOUBLE_EQ(share.Account(b), 10) << "newcomers are served at once";
    EXPECT_THAT(Order(&share, &a), ElementsAre(2, 1));
    share.Use(2, b, 1, {});
    EXPECT_THAT(Order(&share, &a), ElementsAre(1, 2));
    EXPECT_THAT(Order(&share, &b), ElementsAre(2, 1));
    share.Use(2, b, 19, {});
    EXPECT_THAT(Order(&share, &b), ElementsAre(1, 2));
    share.Remove(2);
    EXPECT_THAT(Order(&share, &b), ElementsAre(1));
}

TEST(FairShare, ComingAndGoingGainsNothing) {
    FairShare share;
    share.SetSlack(1);
    const FairShare::Key a{0, "a"}, b{0, "b"};
    share.Put(1, a, true);
    share.Put(2, b, true);
    share.Use(2, b, 50, {});
    for (int i = 0; i < 5; ++i) {
        share.Remove(2);
        share.Put(2, b, true);
    }
    EXPECT_GE(share.Account(b), 49);
    // Nor does staying away save anything up.
    share.Remove(1);
    share.Use(2, b, 50, {});
    share.Put(1, a, true);
    EXPECT_DOUBLE_EQ(share.Account(a), share.Account(b) - 1);
    // When nobody is there all begin anew.
    share.Remove(1);
    share.Lend({b, 5});
    share.Remove(2);
    EXPECT_GT(share.Account(b), 0);
    share.Return({b, 5});
    EXPECT_EQ(share.Account(b), 0);
}

TEST(FairShare, ShareIsOfTheLastMinute) {
    FairShare share;
    share.Put(1, {0, "a"}, true);
    share.Put(2, {0, "b"}, true);
    EXPECT_EQ(share.Share(1, {}), 0);
    share.Use(1, {0, "a"}, 30, {});
    share.Use(2, {0, "b"}, 10, {});
    EXPECT_DOUBLE_EQ(share.Share(1, {}), 0.75);
    const TimePoint later = TimePoint{} + FromSeconds(600);
    share.Use(2, {0, "b"}, 10, later);
    EXPECT_NEAR(share.Share(1, later), 0, 0.001);
    EXPECT_NEAR(share.Share(2, later), 1, 0.001);
}

TEST(FairQueue, OwnersGetEqualCoreSecondsWhateverTheyAskFor) {
    // One has six cheap jobs, one a single job of dear samples, one comes later.
    SharedFarm farm({1e4, 1e4, 2e4, 4e4});
    for (int i = 0; i < 6; ++i) {
        farm.AddJob(fmt::format("jobs/a{}", i), "ann");
    }
    farm.AddJob("jobs/b", "bob", 0, 3);
    const auto ann = [&] {
        double sum = 0;
        for (const auto& [job, used] : farm.used) {
            sum += job.starts_with("jobs/a") ? used : 0;
        }
        return sum;
    };
    // A lease of bob's takes 1.2 s where workers are slowest, and each holds two.
    constexpr double kLeases = 4 * 2 * 1.2;
    for (const double t : {20.0, 40.0, 80.0}) {
        farm.RunUntil(t);
        EXPECT_NEAR(ann(), farm.used["jobs/b"], 2 * kStay + kLeases) << t;
        EXPECT_GE(ann() + farm.used["jobs/b"], 4 * t - kLeases) << "nobody is idle";
    }
    const double ann_before = ann(), bob_before = farm.used["jobs/b"];
    farm.AddJob("jobs/c", "cid", 0, 0.5);
    farm.RunUntil(240);
    const double each = 4 * 160 / 3.0;
    EXPECT_NEAR(ann() - ann_before, each, 2 * kStay + kLeases);
    EXPECT_NEAR(farm.used["jobs/b"] - bob_before, each, 2 * kStay + kLeases);
    EXPECT_NEAR(farm.used["jobs/c"], each, 2 * kStay + kLeases);
    EXPECT_NEAR(*farm.queue.ShareOf("jobs/c", farm.At()), 1 / 3.0, 0.1);
}

TEST(FairQueue, ANewOwnerIsServedAtOnceAndTheOldestJobOfEachFirst) {
    SharedFarm farm({1e4});
    farm.AddJob("jobs/a", "ann");
    farm.RunUntil(100);
    farm.AddJob("jobs/b1", "bob");
    farm.AddJob("jobs/b2", "bob");
    farm.RunUntil(100.5);  // its first pass is planned while a lease of the other goes out
    farm.lent.clear();
    farm.RunUntil(102);
    ASSERT_FALSE(farm.lent.empty());
    EXPECT_THAT(farm.lent, Each("jobs/b1"));
    farm.RunUntil(200);
    EXPECT_EQ(farm.used.count("jobs/b2"), 0u);
    EXPECT_NEAR(farm.used["jobs/a"] - 100, farm.used["jobs/b1"], 2 * kStay + 1);
}

TEST(FairQueue, AWorkerDoesNotChangeScenesWithEachLease) {
    SharedFarm farm({1e4, 1e4});
    for (const char* owner : {"ann", "bob", "cid"}) {
        farm.AddJob(std::string("jobs/") + owner, owner);
    }
    farm.RunUntil(120);
    ASSERT_GT(farm.lent.size(), 400u);
    for (const char* job : {"jobs/ann", "jobs/bob", "jobs/cid"}) {
        EXPECT_NEAR(farm.used[job], 80, 2 * kStay + 1);
    }
    // A turn is as long as it takes to come from one slack behind to one ahead.
    EXPECT_LT(farm.changes, 2 * 120 / kStay);
}

TEST(FairQueue, AHigherPriorityGetsTheNextLeaseAndNothingIsLost) {
    SharedFarm farm({1e4, 3e4});
    farm.AddJob("jobs/low", "ann");
    farm.RunUntil(10.05);
    farm.AddJob("jobs/high", "ann", 1, 1, 256);
    farm.RunUntil(10.3);  // its first pass is planned while a lease of the other goes out
    EXPECT_GT(farm.Held("jobs/low"), 0u);
    const std::uint64_t done = farm.queue.Get("jobs/low").samples_done;
    farm.lent.clear();
    farm.RunUntil(12);
    EXPECT_THAT(farm.lent, Each("jobs/high"));
    EXPECT_EQ(farm.Held("jobs/low"), 0u);
    EXPECT_GT(farm.queue.Get("jobs/low").samples_done, done) << "what was out is finished";
    EXPECT_EQ(farm.queue.Get("jobs/low").leases_reissued, 0u);
    EXPECT_EQ(farm.queue.Get("jobs/low").results_duplicate, 0u);
    // What it leaves goes to the other, and the other goes first when it is asked to.
    farm.queue.SetPriority("jobs/low", 2, farm.At());
    farm.lent.clear();
    farm.RunUntil(12.5);
    EXPECT_THAT(farm.lent, Each("jobs/low"));
    farm.queue.SetPriority("jobs/low", -100, farm.At());
    farm.RunUntil(60);
    EXPECT_EQ(farm.queue.Get("jobs/high").state, JobState::kFiltering);
    EXPECT_GT(farm.Held("jobs/low"), 0u);
    EXPECT_THROW(farm.queue.SetPriority("jobs/low", 101, farm.At()), Error);
    EXPECT_THROW(farm.queue.SetPriority("jobs/low", -101, farm.At()), Error);
}

TEST(FairQueue, JobsThatWaitTakeNoMemory) {
    SharedFarm farm({1e4, 1e4});
    for (int i = 0; i < 100; ++i) {
        farm.AddJob(fmt::format("jobs/{}", i), fmt::format("owner{}", i / 50));
    }
    farm.RunUntil(30);
    EXPECT_EQ(farm.queue.Rendering().size(), 2u) << "one of each owner";
}

TEST(FairQueue, BitsDoNotDependOnOthers) {
    SharedFarm alone({1e4});
    alone.AddJob("jobs/a", "ann", 0, 1, 256);
    alone.RunUntil(1000);
    ASSERT_NE(alone.films["jobs/a"], nullptr);

    SharedFarm farm({1e4, 3e4, 2e4});
    farm.AddJob("jobs/a", "ann", 0, 1, 256);
    farm.AddJob("jobs/b", "bob");
    for (int i = 0; i < 20; ++i) {
        farm.RunUntil(farm.now + 0.2);
        farm.queue.SetPriority("jobs/a", i % 3 - 1, farm.At());
        if (!IsOver(farm.queue.Get("jobs/a").state) && farm.films.count("jobs/a") == 0) {
            i % 2 == 0 ? farm.queue.Pause("jobs/a", farm.At())
                       : farm.queue.Resume("jobs/a", farm.At());
        }
    }
    farm.queue.SetPriority("jobs/a", 0, farm.At());
    farm.RunUntil(200);
    ASSERT_NE(farm.films["jobs/a"], nullptr);
    for (int c = 0; c < kFilmChannelCount; ++c) {
        ASSERT_TRUE(
            std::ranges::equal(farm.films["jobs/a"]->Plane(c), alone.films["jobs/a"]->Plane(c)))
            << FilmChannelNames()[static_cast<std::size_t>(c)];
    }
}

}  // namespace
}  // namespace relume::jobs
