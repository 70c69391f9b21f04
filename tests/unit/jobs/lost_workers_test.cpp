// Which job pays for workers that are lost, and that others do not.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <map>
#include <random>

#include "server/jobs/job_queue.h"
#include "tests/unit/jobs/plan_now.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

class LostWorkers : public testing::Test {
  protected:
    // Tiles of 16 on 64x64 pixels: 16 units in the pilot.
    void AddJob(const std::string& name) {
        JobSetup setup;
        setup.window = {0, 0, 64, 64};
        setup.display_width = setup.display_height = 64;
        setup.tile_size = 16;
        setup.budgets.samples = 64 * 64 * 8;
        setup.planner = MakePlanner("uniform");
        queue.AddJob(name, std::move(setup), now);
    }
    WorkerId AddWorker(const std::string& machine, bool ready = true) {
        const WorkerId id = queue.AddWorker(fmt::format("w{}", ++started), "avx2", 1, now);
        queue.SetMachine(id, machine);
        queue.SetCredits(id, 3, 0);
        if (ready) {
            for (const char* job : {"jobs/a", "jobs/b"}) {
                queue.SceneReady(id, job, {}, now);
            }
        }
        return id;
    }
    std::vector<LeaseGrant> TakeAll(WorkerId id) {
        std::vector<LeaseGrant> leases;
        for (;;) {
            if (auto lease = queue.NextLease(id, now)) {
                leases.push_back(std::move(*lease));
            } else if (!PlanNow(&queue, now)) {
                return leases;
            }
        }
    }
    void Lose(WorkerId id) {
        now += FromSeconds(1);
        queue.LoseWorker(id, "was lost", now);
        now += FromSeconds(1);
    }
    void Deliver(WorkerId id, const LeaseGrant& lease) {
        EXPECT_EQ(queue.AddResult(id, lease.id, lease.job, PseudoRender(lease.task), now),
                  ResultVerdict::kMerged);
    }
    JobState State(const std::string& job) const { return queue.Get(job).state; }

    JobQueue queue;
    TimePoint now{FromSeconds(1)};
    int started = 0;
};

TEST_F(LostWorkers, AUnitThatCrashesWorkersIsTriedOnceElsewhereThenItsJobFails) {
    AddJob("jobs/a");
    AddJob("jobs/b");
    const WorkerId first = AddWorker("m1"), here = AddWorker("m1"), elsewhere = AddWorker("m2");
    const auto leases = TakeAll(first);
    ASSERT_EQ(leases.size(), 3u);
    queue.Crashed(first, "jobs/a", leases[1].id, SIGSEGV);
    Lose(first);
    EXPECT_EQ(State("jobs/a"), JobState::kRendering);
    EXPECT_THAT(queue.Get("jobs/a").notes, Contains(HasSubstr("SIGSEGV")));
    // Not where it crashed before.
    for (const auto& lease : TakeAll(here)) {
        EXPECT_NE(lease.unit, leases[1].unit);
        Deliver(here, lease);
    }
    const auto again = TakeAll(elsewhere);
    ASSERT_EQ(again[0].unit, leases[1].unit);
    queue.Crashed(elsewhere, "jobs/a", again[0].id, SIGSEGV);
    Lose(elsewhere);
    EXPECT_EQ(State("jobs/a"), JobState::kFailed);
    EXPECT_THAT(queue.Get("jobs/a").message,
                AllOf(HasSubstr("worker w3 died of signal 11 (SIGSEGV)"), HasSubstr("worker w1"),
                      HasSubstr("pixels")));
    // The other job goes on with whoever is left.
    const auto rest = TakeAll(here);
    ASSERT_FALSE(rest.empty());
    EXPECT_EQ(rest[0].job, "jobs/b");
}

TEST_F(LostWorkers, ASceneThatCrashesTheOnlyWorkerTwiceWhileItLoadsFails) {
    AddJob("jobs/a");
    for (int n = 0; n < 2; ++n) {
        EXPECT_NE(State("jobs/a"), JobState::kFailed);
        const WorkerId w = AddWorker("m1", false);
        ASSERT_EQ(TakeAll(w).size(), 3u);
        queue.Crashed(w, "jobs/a", 0, SIGABRT);
        Lose(w);
    }
    EXPECT_EQ(State("jobs/a"), JobState::kFailed);
    EXPECT_THAT(queue.Get("jobs/a").message,
                AllOf(HasSubstr("SIGABRT"), HasSubstr("it loaded the scene")));
}

TEST_F(LostWorkers, CrashesOverDifferentUnitsCountTogetherUnlessTheJobGetsOn) {
    AddJob("jobs/a");
    AddJob("jobs/b");
    const auto crash = [&](const std::string& job, std::size_t at, bool deliver) {
        const WorkerId w = AddWorker("m1");
        const auto leases = TakeAll(w);
        ASSERT_EQ(leases.at(at).job, job);
        if (deliver) {
            Deliver(w, leases[0]);
        }
        queue.Crashed(w, job, leases[at].id, SIGFPE);
        Lose(w);
    };
    crash("jobs/a", 0, false);
    crash("jobs/a", 2, true);
    EXPECT_EQ(State("jobs/a"), JobState::kRendering);
    crash("jobs/a", 1, false);
    EXPECT_EQ(State("jobs/a"), JobState::kFailed);
}

TEST_F(LostWorkers, WhatKillsWorkersWithoutAWordIsTriedAloneAndFailsAtLast) {
    AddJob("jobs/a");
    AddJob("jobs/b");
    int lost = 0;
    for (; State("jobs/a") != JobState::kFailed && lost < 2 * kMaxLosses; ++lost) {
        const WorkerId w = AddWorker("m1");
        const auto leases = TakeAll(w);
        ASSERT_EQ(leases.size(), lost < kLossesTogether ? 3u : 1u);
        if (lost >= kLossesTogether) {
            EXPECT_EQ(leases[0].unit, 0u);
        }
        EXPECT_EQ(leases[0].job, "jobs/a");
        Lose(w);
    }
    EXPECT_EQ(lost, kMaxLosses);
    EXPECT_THAT(queue.Get("jobs/a").message, HasSubstr("was lost while it had pixels"));
    EXPECT_NE(State("jobs/b"), JobState::kFailed);
}

TEST_F(LostWorkers, AUnitThatIsTriedAloneWaitsForEmptyHandsAndOthersGoOn) {
    AddJob("jobs/a");
    const auto busy = AddWorker("m1");
    const auto held = TakeAll(busy);
    std::size_t unit = 0;
    for (int n = 0; n < kLossesTogether; ++n) {
        const WorkerId w = AddWorker("m1");
        unit = TakeAll(w).at(0).unit;
        Lose(w);
    }
    const WorkerId other = AddWorker("m1");
    // The first that asks lets its hands get empty; the other one works on.
    Deliver(busy, held[0]);
    EXPECT_THAT(TakeAll(busy), IsEmpty());
    const auto rest = TakeAll(other);
    ASSERT_EQ(rest.size(), 3u);
    EXPECT_THAT(rest, testing::Each(testing::Field(&LeaseGrant::unit, testing::Ne(unit))));
    Deliver(busy, held[1]);
    EXPECT_THAT(TakeAll(busy), IsEmpty());
    Deliver(busy, held[2]);
    const auto alone = TakeAll(busy);
    ASSERT_EQ(alone.size(), 1u);
    EXPECT_EQ(alone[0].unit, unit);
    // Once it is done, all is as before.
    Deliver(busy, alone[0]);
    std::vector<WorkerId> workers{busy, other};
    for (const auto& lease : rest) {
        Deliver(other, lease);
    }
    for (bool more = true; more;) {
        more = false;
        for (const WorkerId w : workers) {
            for (const auto& lease : TakeAll(w)) {
                Deliver(w, lease);
                more = true;
            }
        }
    }
    EXPECT_EQ(State("jobs/a"), JobState::kFiltering);
}

TEST_F(LostWorkers, WhoeverHoldsTheSecondTryOfAnInnocentOneIsNotBlamed) {
    // All workers at once, again and again, as when a network fails: one loss each time.
    AddJob("jobs/a");
    for (int n = 0; n < kMaxLosses - 1; ++n) {
        std::vector<WorkerId> workers;
        for (int i = 0; i < 8; ++i) {
            workers.push_back(AddWorker("m1", false));
            TakeAll(workers.back());
        }
        now += FromSeconds(1);
        for (const WorkerId w : workers) {
            queue.LoseWorker(w, "was lost", now);
        }
        now += FromSeconds(1);
    }
    EXPECT_EQ(State("jobs/a"), JobState::kRendering);
    // One that loads it clears it.
    const WorkerId w = AddWorker("m1", false);
    ASSERT_EQ(TakeAll(w).size(), 1u);
    queue.SceneReady(w, "jobs/a", {}, now);
    EXPECT_EQ(TakeAll(w).size(), 2u);
    Lose(w);
    EXPECT_EQ(State("jobs/a"), JobState::kRendering);
}

TEST_F(LostWorkers, RandomKillsFailNoJob) {
    // Four workers, each killed after some seven units and started anew: jobs come to their end.
    for (const unsigned seed : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u}) {
        const std::string job = fmt::format("jobs/{}", seed);
        AddJob(job);
        std::mt19937 random(seed);
        std::map<WorkerId, std::vector<LeaseGrant>> farm;
        for (int step = 0; step < 4000 && State(job) != JobState::kFiltering; ++step) {
            while (farm.size() < 4) {
                const WorkerId id = AddWorker("m1", false);
                queue.SceneReady(id, job, {}, now);
                farm[id];
            }
            now += FromSeconds(0.1);
            auto it = std::next(farm.begin(), random() % 4);
            auto& [id, held] = *it;
            for (auto& lease : TakeAll(id)) {
                held.push_back(std::move(lease));
            }
            if (random() % 8 == 0) {
                queue.LoseWorker(id, "was lost", now);
                farm.erase(it);
            } else if (!held.empty()) {
                queue.AddResult(id, held[0].id, job, PseudoRender(held[0].task), now);
                held.erase(held.begin());
            }
        }
        EXPECT_EQ(State(job), JobState::kFiltering) << queue.Get(job).message;
        for (const auto& [id, held] : farm) {
            queue.RemoveWorker(id);
        }
    }
}

TEST_F(LostWorkers, WhoTakesItsLeaveIsNotLost) {
    AddJob("jobs/a");
    for (int n = 0; n < 2 * kMaxLosses; ++n) {
        const WorkerId w = AddWorker("m1");
        std::vector<LeaseId> ids;
        for (const auto& lease : TakeAll(w)) {
            ids.push_back(lease.id);
        }
        EXPECT_EQ(ids.size(), 3u);
        queue.ReturnLeases(w, ids);
        Lose(w);
    }
    EXPECT_EQ(State("jobs/a"), JobState::kRendering);
}

TEST_F(LostWorkers, LastWordsThatMakeNoSenseBlameNobody) {
    AddJob("jobs/a");
    for (const LeaseId lease : {LeaseId{0}, LeaseId{77}}) {
        for (const char* job : {"jobs/a", "jobs/none", ""}) {
            const WorkerId w = AddWorker("m1");
            queue.Crashed(w, job, lease, 12345);  // it was given nothing
            Lose(w);
        }
    }
    EXPECT_EQ(State("jobs/a"), JobState::kQueued);
}

}  // namespace
}  // namespace relume::jobs
