// Units that two workers render, and workers that are found odd.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "core/base/error.h"
#include "core/base/sha256.h"
#include "core/film/aov.h"
#include "server/jobs/job_queue.h"
#include "tests/unit/jobs/plan_now.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

class CrossCheck : public testing::Test {
  protected:
    // Four units in each of the two passes.
    void AddJob(double share) {
        queue.SetCrossCheck(share, 1234);
        JobSetup setup;
        setup.window = {0, 0, 32, 32};
        setup.display_width = setup.display_height = 32;
        setup.tile_size = 16;
        setup.budgets.samples = 32 * 32 * 8;
        setup.planner = MakePlanner("uniform");
        queue.AddJob("jobs/a", std::move(setup), now);
    }
    WorkerId AddWorker(const std::string& name, const std::string& machine) {
        const WorkerId id = queue.AddWorker(name, "avx2", 1, now);
        queue.SetMachine(id, machine);
        queue.SetCredits(id, 2, 0);
        queue.SceneReady(id, "jobs/a", {}, now);
        return id;
    }
    // Renders all that the workers are lent; those in `odd` make the same mistake each time, those
    // in `random` another one. False if there was nothing.
    bool Round(const std::vector<WorkerId>& workers, const std::set<WorkerId>& odd = {},
               const std::set<WorkerId>& random = {}) {
        bool any = false;
        for (const WorkerId id : workers) {
            std::vector<LeaseGrant> leases;
            for (bool more = true; more;) {
                if (auto lease = queue.NextLease(id, now)) {
                    leases.push_back(std::move(*lease));
                } else {
                    more = PlanNow(&queue, now);
                }
            }
            for (const auto& lease : leases) {
                any = true;
                asked[lease.unit].insert(id);
                TileResult result = PseudoRender(lease.task);
                // A mean that is off by a little passes every check of a single answer.
                float& value = result.planes[kMeanA * result.pixels.size()];
                value += odd.count(id) != 0 ? 0.125F : 0;
                value += random.count(id) != 0 ? 0.001F * static_cast<float>(++mistakes) : 0;
                queue.AddResult(id, lease.id, lease.job, std::move(result), now);
            }
        }
        now += FromSeconds(0.1);
        for (const WorkerId id : workers) {
            queue.Heard(id, now);
        }
        queue.Tick(now);
        return any;
    }
    JobState State() const { return queue.Get("jobs/a").state; }
    CheckCounts Counts() const { return queue.Status(now, 9, 9).checks; }
    std::string ImageOf(const JobQueue::FilterWork& work) const {
        std::string bytes;
        for (const TileRect& tile : CutIntoTiles({0, 0, 32, 32}, 16)) {
            bytes += work.film->SaveTile(tile);
        }
        return Sha256Hex(bytes);
    }
    std::string Honest() {
        CrossCheck honest;
        honest.AddJob(0);
        const WorkerId w = honest.AddWorker("w", "m");
        while (honest.Round({w})) {
        }
        return ImageOf(*honest.queue.TakeFilterWork());
    }
    void TestBody() override {}

    JobQueue queue;
    TimePoint now{FromSeconds(1)};
    std::map<std::uint64_t, std::set<WorkerId>> asked;
    int mistakes = 0;
};

TEST_F(CrossCheck, EachChosenUnitIsRenderedOnTwoMachines) {
    AddJob(1);
    const std::vector<WorkerId> w{AddWorker("a", "m1"), AddWorker("b", "m1"), AddWorker("c", "m2")};
    while (Round(w)) {
    }
    EXPECT_EQ(State(), JobState::kFiltering);
    EXPECT_EQ(Counts().equal, 8u);
    EXPECT_EQ(Counts().odd + Counts().alone, 0u);
    ASSERT_EQ(asked.size(), 8u);
    for (const auto& [unit, workers] : asked) {
        EXPECT_EQ(workers.count(w[2]), 1u) << unit;
        EXPECT_EQ(workers.size(), 2u) << unit;
    }
    EXPECT_EQ(queue.Get("jobs/a").audit->problem, "");
    EXPECT_EQ(ImageOf(*queue.TakeFilterWork()), Honest());
}

TEST_F(CrossCheck, AShareOfTheUnitsIsChosen) {
    CrossChecks checks;
    checks.Configure(0.05, 7);
    int chosen = 0;
    for (std::size_t unit = 0; unit < 20000; ++unit) {
        chosen += checks.Chosen(3, unit) ? 1 : 0;
    }
    EXPECT_NEAR(chosen, 1000, 5 * 31);  // five deviations of a binomial
    checks.Configure(0, 7);
    EXPECT_FALSE(checks.Chosen(3, 0));
    checks.Configure(1, 7);
    EXPECT_TRUE(checks.Chosen(3, 0));
}

TEST_F(CrossCheck, AnOddWorkerIsOutvotedAndGetsNoMore) {
    AddJob(1);
    const std::vector<WorkerId> w{AddWorker("bad", "m1"), AddWorker("b", "m2"),
                                  AddWorker("c", "m3")};
    while (Round(w, {w[0]})) {
    }
    EXPECT_EQ(State(), JobState::kFiltering);
    EXPECT_EQ(Counts().odd, 1u);
    EXPECT_EQ(ImageOf(*queue.TakeFilterWork()), Honest());
    EXPECT_THAT(queue.Workers(now)[0].quarantined, HasSubstr("not that of two others"));
    EXPECT_THAT(queue.Workers(now)[1].quarantined, IsEmpty());
    EXPECT_EQ(queue.Status(now, 9, 9).workers_quarantined, 1u);
    EXPECT_EQ(queue.Get("jobs/a").workers.count("bad"), 0u);
    // It does not help to connect again; another process of the machine is another worker.
    queue.RemoveWorker(w[0]);
    const WorkerId again = AddWorker("bad", "m1"), other = AddWorker("other", "m1");
    EXPECT_THAT(queue.Workers(now)[2].quarantined, HasSubstr("not that of two others"));
    EXPECT_THAT(queue.Workers(now)[3].quarantined, IsEmpty());
    EXPECT_NE(again, other);
}

TEST_F(CrossCheck, AQuarantineIsListedUntilItIsReleased) {
    AddJob(1);
    const std::vector<WorkerId> w{AddWorker("bad", "m1"), AddWorker("b", "m2"),
                                  AddWorker("c", "m3")};
    now += FromSeconds(7);
    Round(w, {w[0]});
    const TimePoint since = queue.Workers(now)[0].quarantined_since;
    EXPECT_GE(ToSeconds(since - TimePoint{}), 7);
    EXPECT_FALSE(queue.Workers(now)[0].away);
    EXPECT_FALSE(queue.NextLease(w[0], now));

    // It is known while it is away, and when it is back.
    queue.RemoveWorker(w[0]);
    const auto listed = queue.Workers(now);
    ASSERT_EQ(listed.size(), 3u);
    EXPECT_EQ(listed[2].name, "bad");
    EXPECT_TRUE(listed[2].away);
    EXPECT_EQ(listed[2].quarantined_since, since);
    const WorkerId again = AddWorker("bad", "m1");
    EXPECT_EQ(queue.Workers(now).size(), 3u);
    EXPECT_EQ(queue.Workers(now)[2].quarantined_since, since);
    EXPECT_FALSE(queue.NextLease(again, now));

    for (const char* name : {"b", "nobody"}) {
        try {
            queue.Release(name);
            ADD_FAILURE() << name;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::kNotFound);
        }
    }
    queue.Release("bad");
    EXPECT_TRUE(queue.TakeNews());
    EXPECT_THAT(queue.Workers(now)[2].quarantined, IsEmpty());
    EXPECT_TRUE(queue.NextLease(again, now));
    queue.RemoveWorker(again);
    EXPECT_EQ(queue.Workers(now).size(), 2u);
}

TEST_F(CrossCheck, WhatAQuarantinedWorkerHasInTheFilmIsSaid) {
    AddJob(0);
    const std::vector<WorkerId> w{AddWorker("bad", "m1"), AddWorker("b", "m2"),
                                  AddWorker("c", "m3")};
    Round({w[0]}, {w[0]});  // two of eight units, unchecked
    queue.SetCrossCheck(1, 5);
    while (Round(w, {w[0]})) {
    }
    EXPECT_EQ(State(), JobState::kFiltering);
    EXPECT_THAT(queue.Get("jobs/a").notes, Contains(AllOf(HasSubstr("worker bad is in quarantine"),
                                                          HasSubstr("% of the samples"))));
    EXPECT_NE(ImageOf(*queue.TakeFilterWork()), Honest());
}

TEST_F(CrossCheck, OneThatContradictsItselfIsFoundWithoutAThird) {
    AddJob(1);
    const std::vector<WorkerId> w{AddWorker("bad", "m1"), AddWorker("b", "m2")};
    while (Round(w, {}, {w[0]})) {
    }
    EXPECT_EQ(State(), JobState::kFiltering);
    EXPECT_THAT(queue.Workers(now)[0].quarantined, HasSubstr("another each time"));
    EXPECT_EQ(ImageOf(*queue.TakeFilterWork()), Honest());
    EXPECT_GT(Counts().alone, 0u);
}

TEST_F(CrossCheck, TwoThatStickToTheirAnswersWaitForAThird) {
    AddJob(1);
    std::vector<WorkerId> w{AddWorker("bad", "m1"), AddWorker("b", "m2")};
    int rounds = 0;
    while (Round(w, {w[0]})) {
        ASSERT_LT(++rounds, 50);
    }
    EXPECT_EQ(State(), JobState::kRendering);
    EXPECT_EQ(queue.Get("jobs/a").samples_done, 0u);
    EXPECT_THAT(queue.Get("jobs/a").notes, Contains(HasSubstr("a third one must decide")));
    w.push_back(AddWorker("c", "m2"));
    while (Round(w, {w[0]})) {
    }
    EXPECT_EQ(State(), JobState::kFiltering);
    EXPECT_EQ(ImageOf(*queue.TakeFilterWork()), Honest());
}

TEST_F(CrossCheck, ALoneWorkersAnswersCountAndSoDoThoseOfOneThatIsLeftAlone) {
    AddJob(1);
    const WorkerId a = AddWorker("a", "m1"), b = AddWorker("b", "m2");
    Round({a});
    EXPECT_EQ(queue.Get("jobs/a").samples_done, 0u);
    queue.RemoveWorker(b);
    while (Round({a})) {
    }
    EXPECT_EQ(State(), JobState::kFiltering);
    EXPECT_EQ(Counts().alone, 8u);
    EXPECT_EQ(ImageOf(*queue.TakeFilterWork()), Honest());
}

TEST_F(CrossCheck, AnAnswerOfOneThatHasLeftStillCounts) {
    AddJob(1);
    const WorkerId a = AddWorker("a", "m1"), b = AddWorker("b", "m2");
    Round({a});
    queue.RemoveWorker(a);
    while (Round({b})) {
    }
    EXPECT_EQ(State(), JobState::kFiltering);
    EXPECT_EQ(queue.Get("jobs/a").audit->problem, "");
    EXPECT_EQ(ImageOf(*queue.TakeFilterWork()), Honest());
}

TEST_F(CrossCheck, AJobThatEndsForgetsItsAnswers) {
    AddJob(1);
    const WorkerId a = AddWorker("a", "m1");
    AddWorker("b", "m2");
    Round({a});
    queue.Cancel("jobs/a", now);
    queue.ForgetOverJobs(0);
    queue.Tick(now);
    EXPECT_FALSE(queue.Knows("jobs/a"));
}

}  // namespace
}  // namespace relume::jobs
