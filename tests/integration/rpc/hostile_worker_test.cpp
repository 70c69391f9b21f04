#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/film/aov.h"
#include "tests/integration/rpc/farm_fixture.h"
#include "tests/integration/rpc/hand.h"

namespace relume::server {
namespace {

using testing::Contains;
using testing::Each;
using testing::HasSubstr;
using testing::Not;

// Whatever one worker says: the image is that of honest ones, the server lives, and the worker is
// named.
class HostileWorkerTest : public FarmFixture {
  protected:
    HostileWorkerTest() {
        const auto worker = StartWorker();
        due = WaitForEnd(MustCreate(Spec()).name()).image_sha256();
        EXPECT_EQ(due.size(), 64u);
    }
    void SetUp() override { WaitUntilAlone(); }

    // The job is finished by an honest worker, to the right image.
    v1::Job Finish(const v1::Job& job) {
        const auto worker = StartWorker();
        v1::Job done = WaitForEnd(job.name());
        EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED) << done.message();
        EXPECT_EQ(done.image_sha256(), due);
        EXPECT_EQ(done.samples_done(), 48u * 40u * 8u);
        EXPECT_EQ(done.ledger().problem(), "");
        return done;
    }
    // An answer to the lease with whatever `lie` makes of the right one, and checksums of that.
    static v1::WorkRequest Lie(const WorkerHand& hand, const v1::Lease& lease,
                               const std::function<void(TileResult*)>& lie) {
        v1::WorkRequest message = FakeWorker::Render(hand.context, lease, false);
        v1::LeaseResult* result = message.mutable_result();
        TileResult tile = codec::DecodePlanes(codec::TaskFromLease(lease), result->planes());
        tile.rays = result->rays();
        tile.seconds = result->seconds();
        lie(&tile);
        result->set_planes(codec::EncodePlanes(tile));
        result->set_rays(tile.rays);
        result->set_seconds(tile.seconds);
        codec::SetDigests(result->task_digest(), tile, result);
        return message;
    }

    std::string due;
};

TEST_F(HostileWorkerTest, ResultsThatCantBeAreRefusedAndTheWorkerNamed) {
    const auto set = [](int plane, float value) {
        return [plane, value](TileResult* tile) {
            tile->planes[static_cast<std::size_t>(plane) * tile->pixels.size()] = value;
        };
    };
    const std::vector<std::pair<const char*, std::function<void(TileResult*)>>> lies{
        {"says that it took 1e+300 s", [](TileResult* t) { t->seconds = 1e300; }},
        {"says that it took -", [](TileResult* t) { t->seconds = -1; }},
        {"says that it took", [](TileResult* t) { t->seconds = std::nan(""); }},
        {"says that it took inf", [](TileResult* t) { t->seconds = INFINITY; }},
        {"says that it traced", [](TileResult* t) { t->rays = ~std::uint64_t{0}; }},
        {"counts 1e+30", set(kCountA, 1e30f)},
        {"counts -1", set(kCountA, -1)},
        {"n_a = nan", set(kCountA, NAN)},
        {"counts", set(kBadCount, 3)},
        {"mean_a.R = nan", set(kMeanA, NAN)},
        {"mean_b.R = inf", set(kMeanB, INFINITY)},
        {"m2_a.R = -1", set(kM2A, -1)},
        {"m2_b.R = nan", set(kM2B, NAN)},
        {"bytes, ", [](TileResult* t) { t->planes.pop_back(); }},
        {"bytes, ", [](TileResult* t) { t->planes.resize(2 * t->planes.size()); }},
        {"bytes, ", [](TileResult* t) { t->planes.clear(); }},
    };
    for (const auto& [why, lie] : lies) {
        SCOPED_TRACE(why);
        const v1::Job job = MustCreate(Spec());
        WorkerHand mallory(work.get(), "mallory");
        mallory.Want(1);
        const v1::Lease lease = mallory.TakeLease();
        mallory.Send(Lie(mallory, lease, lie));
        const v1::Job noted =
            WaitUntil(job.name(), [](const v1::Job& j) { return j.notes_size() > 0; });
        EXPECT_THAT(noted.notes(0), testing::AllOf(HasSubstr("worker mallory"), HasSubstr(why)));
        EXPECT_EQ(noted.samples_done(), 0u);
        mallory.End();
        Finish(job);
        WaitUntilAlone();
    }
}

TEST_F(HostileWorkerTest, TheLargestFiniteNumbersHarmNobodyElse) {
    const v1::Job other = MustCreate(Spec());
    v1::JobSpec spec = Spec();
    spec.set_filter("bilateral");
    const v1::Job job = MustCreate(spec);
    {
        WorkerHand mallory(work.get(), "mallory");
        mallory.Want(1);
        for (;;) {
            const v1::Lease lease = mallory.TakeLease();
            if (lease.job() == job.name()) {
                mallory.Send(Lie(mallory, lease, [](TileResult* tile) {
                    for (int c = kMeanA; c < kFilmChannelCount; ++c) {
                        for (std::size_t k = 0; k < tile->pixels.size(); ++k) {
                            tile->planes[static_cast<std::size_t>(c) * tile->pixels.size() + k] =
                                std::numeric_limits<float>::max();
                        }
                    }
                }));
                break;
            }
            mallory.Send(FakeWorker::Render(mallory.context, lease, false));
        }
        WaitUntil(job.name(), [](const v1::Job& j) { return j.samples_done() > 0; });
    }
    Finish(other);
    const auto worker = StartWorker();
    WaitForEnd(job.name());  // to whatever end
    Finish(MustCreate(Spec()));
}

TEST_F(HostileWorkerTest, AnswersThatNobodyAskedForAreDropped) {
    const v1::Job job = MustCreate(Spec());
    WorkerHand honest(work.get(), "honest");
    honest.Want(1);
    const v1::Lease lease = honest.TakeLease();
    const v1::WorkRequest right = FakeWorker::Render(honest.context, lease, false);

    WorkerHand mallory(work.get(), "mallory");
    // Somebody else's lease, with and without lies about its unit and its job; one that is not
    // there; one of another start of the server.
    v1::WorkRequest stolen = right;
    stolen.mutable_result()->clear_ticket();
    mallory.Send(stolen);
    stolen.mutable_result()->set_unit(~std::uint64_t{0});
    mallory.Send(stolen);
    stolen.mutable_result()->set_job("jobs/none");
    mallory.Send(stolen);
    stolen = right;
    stolen.mutable_result()->clear_ticket();
    stolen.mutable_result()->set_lease_id(lease.id() + 1000);
    mallory.Send(stolen);
    stolen.mutable_result()->set_epoch(lease.epoch() + 1);
    mallory.Send(stolen);
    WaitUntil(job.name(), [](const v1::Job& j) { return j.results_duplicate() >= 4; });
    // Its lease is still with the honest one. What it answers counts once, however often it comes.
    honest.Send(right);
    honest.Send(right);
    honest.Send(right);
    const v1::Job replayed =
        WaitUntil(job.name(), [](const v1::Job& j) { return j.results_duplicate() >= 6; });
    EXPECT_EQ(replayed.samples_done(), codec::TaskFromLease(lease).TotalSamples());
    honest.End();
    mallory.End();
    Finish(job);
}

TEST_F(HostileWorkerTest, LeasesOfOthersCantBeGivenBackNorFilledWithSamples) {
    v1::JobSpec spec = Spec();
    spec.set_filter("rpf:neighbours=64");
    spec.set_keep_samples(true);
    std::string image;
    {
        const auto worker = StartWorker();
        image = WaitForEnd(MustCreate(spec).name()).image_sha256();
    }
    WaitUntilAlone();
    const v1::Job job = MustCreate(spec);
    WorkerHand honest(work.get(), "honest");
    honest.Want(1);
    const v1::Lease lease = honest.TakeLease();
    WorkerHand mallory(work.get(), "mallory");
    v1::WorkRequest message;
    message.mutable_lease_return()->add_lease_ids(lease.id());
    mallory.Send(message);
    message.mutable_samples()->set_lease_id(lease.id());
    message.mutable_samples()->set_data(std::string(1 << 20, 'x'));
    for (int i = 0; i < 20; ++i) {
        message.mutable_samples()->set_offset(static_cast<std::uint64_t>(i) << 20);
        mallory.Send(message);
    }
    message.mutable_result()->set_lease_id(lease.id());
    message.mutable_result()->set_job(job.name());
    message.mutable_result()->set_epoch(lease.epoch());
    mallory.Send(message);
    message.mutable_result()->set_lease_id(0);  // so that we know when all that was read
    mallory.Send(message);
    const v1::Job after =
        WaitUntil(job.name(), [](const v1::Job& j) { return j.results_duplicate() > 0; });
    EXPECT_EQ(after.leases_reissued(), 0u);
    EXPECT_EQ(after.notes_size(), 0);
    honest.End();
    mallory.End();
    const auto worker = StartWorker();
    EXPECT_EQ(WaitForEnd(job.name()).image_sha256(), image);
}

TEST_F(HostileWorkerTest, AJobThatItWasNotToldOfIsNoneOfItsBusiness) {
    const v1::Job job = MustCreate(Spec());
    WorkerHand mallory(work.get(), "mallory");
    v1::WorkRequest message;
    message.mutable_problem()->set_job(job.name());
    message.mutable_problem()->set_message("it is bad");
    mallory.Send(message);
    message.mutable_scene_ready()->set_job(job.name());
    message.mutable_scene_ready()->add_notes("buy more licences");
    mallory.Send(message);
    message.mutable_result()->set_job(job.name());  // so that we know when those were read
    mallory.Send(message);
    WaitUntil(job.name(), [](const v1::Job& j) { return j.results_duplicate() > 0; });
    EXPECT_THAT(Finish(job).notes(), Not(Contains(HasSubstr("licences"))));
}

TEST_F(HostileWorkerTest, WordsAreCutAndNumbersBounded) {
    const v1::Job job = MustCreate(Spec());
    grpc::ClientContext context;
    const auto stream = work->Work(&context);
    v1::WorkRequest message;
    message.mutable_hello()->set_name("mal\x1b[2Jlory\n" + std::string(100'000, 'm'));
    message.mutable_hello()->set_protocol_version(kProtocolVersion);
    message.mutable_hello()->mutable_numeric_class()->set_build(kBuild);
    message.mutable_hello()->mutable_numeric_class()->set_isa("\x1b]0;" +
                                                              std::string(3 << 20, 'i'));
    message.mutable_hello()->set_threads(std::numeric_limits<std::int32_t>::max());
    stream->Write(message);
    message.mutable_report()->set_credits(1);
    message.mutable_report()->set_leases_held(1);
    stream->Write(message);
    v1::WorkResponse response;
    while (stream->Read(&response) && !response.has_lease()) {
    }
    message.mutable_scene_ready()->set_job(job.name());
    message.mutable_scene_ready()->set_seconds(std::nan(""));
    for (int i = 0; i < 2000; ++i) {
        message.mutable_scene_ready()->add_notes(std::to_string(i) + "\x1b[1m" +
                                                 std::string(1500, 'n'));
    }
    stream->Write(message);
    stream->Write(message);
    message.mutable_report()->set_credits(std::numeric_limits<std::uint32_t>::max());
    message.mutable_report()->set_leases_held(std::numeric_limits<std::uint32_t>::max());
    stream->Write(message);
    WaitUntil(job.name(), [](const v1::Job& j) { return j.notes_size() >= 100; });
    v1::Job noted;
    ASSERT_TRUE(Get(job.name(), &noted).ok());
    EXPECT_LE(noted.notes_size(), 100);
    EXPECT_THAT(noted.notes(), Each(Not(HasSubstr("\x1b"))));

    grpc::ClientContext list_context;
    v1::ListWorkersResponse list;
    ASSERT_TRUE(jobs->ListWorkers(&list_context, {}, &list).ok());
    ASSERT_EQ(list.workers_size(), 1);
    EXPECT_LE(list.workers(0).name().size(), 128u);
    EXPECT_LE(list.workers(0).threads(), 4096);
    EXPECT_LE(list.workers(0).numeric_class().isa().size(), 2000u);
    for (const std::string& words :
         {list.workers(0).name(), list.workers(0).numeric_class().isa()}) {
        EXPECT_TRUE(
            std::all_of(words.begin(), words.end(), [](char c) { return c >= ' ' && c != 127; }));
    }
    context.TryCancel();
    stream->Finish();
    v1::Job cancelled;
    EXPECT_TRUE(Cancel(job.name(), &cancelled).ok());
    Finish(MustCreate(Spec()));
}

TEST_F(HostileWorkerTest, WhatIsNoTicketEndsTheStream) {
    WorkerHand mallory(work.get(), "mallory");
    v1::WorkRequest message;
    message.mutable_result()->set_ticket(std::string(3 << 20, 't'));
    mallory.Send(message);
    EXPECT_EQ(mallory.WaitForEnd().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    Finish(MustCreate(Spec()));
}

TEST_F(HostileWorkerTest, StreamsOfOneAddressAreCounted) {
    ServerOptions options;
    options.coordinator.quotas.client_streams = 4;
    Restart(options);
    const v1::Job job = MustCreate(Spec());
    std::vector<std::unique_ptr<WorkerHand>> crowd;
    for (int i = 0; i < 4; ++i) {
        crowd.push_back(std::make_unique<WorkerHand>(work.get()));
        EXPECT_TRUE(crowd.back()->IsWelcome());
    }
    const grpc::Status refused = WorkerHand(work.get()).WaitForEnd();
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(refused.error_message(), HasSubstr("--client-streams"));
    crowd.clear();
    // Room again, once the server has seen them go.
    EXPECT_TRUE(WaitFor([&] {
        WorkerHand hand(work.get());
        hand.Want(1);
        return hand.TakeLease().id() != 0;
    }));
    Finish(job);
}

}  // namespace
}  // namespace relume::server
