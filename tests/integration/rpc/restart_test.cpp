// What is left when the server ends and another one starts on its folder.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "tests/integration/rpc/farm_fixture.h"
#include "tests/integration/rpc/hand.h"
#include "tests/support/failing_disk.h"

namespace relume::server {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
namespace fs = std::filesystem;

class RestartTest : public FarmFixture {
  protected:
    static ServerOptions Saving(double seconds = 0.01) {
        ServerOptions options;
        options.coordinator.films.save_seconds = seconds;
        return options;
    }
    // Of a job, or of all; oldest first of each.
    std::vector<fs::path> Films(const std::string& job = "") const {
        std::vector<fs::path> files;
        for (const auto& entry : fs::directory_iterator(folder.path() / "films")) {
            if (job.empty() ||
                entry.path().filename().string().starts_with(FilmKeeper::FilePrefix(job))) {
                files.push_back(entry.path());
            }
        }
        std::sort(files.begin(), files.end());
        return files;
    }
    // A job of which some, not all, is saved; the server is gone.
    v1::Job HalfDone(const v1::JobSpec& spec, int results) {
        Restart(Saving());
        FakeWorkerOptions stalls;
        stalls.stall_after = results;
        const auto worker = StartWorker(stalls);
        v1::Job job = MustCreate(spec);
        worker->WaitForAcknowledged(1);
        job = WaitUntil(job.name(), [](const v1::Job& j) { return j.save_seconds() > 0; });
        return job;
    }
};

TEST_F(RestartTest, WhatIsOverStaysAsItIs) {
    v1::Job done, cancelled;
    {
        const auto worker = StartWorker();
        ASSERT_TRUE(Create(Spec(), &done, "request-1").ok());
        done = WaitForEnd(done.name());
    }
    cancelled = MustCreate(Spec());
    ASSERT_TRUE(Cancel(cancelled.name(), &cancelled).ok());
    ASSERT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED);
    const std::string image = Fetch(done.name());
    std::vector<v1::WatchJobResponse> before, after;
    ASSERT_TRUE(Watch(done.name(), 0, &before).ok());
    Restart();

    const v1::Job again = Now(done.name());
    EXPECT_EQ(again.state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(again.image_sha256(), done.image_sha256());
    EXPECT_EQ(again.samples_done(), done.samples_done());
    EXPECT_EQ(again.passes_size(), done.passes_size());
    EXPECT_EQ(again.create_time().seconds(), done.create_time().seconds());
    EXPECT_NEAR(again.elapsed_seconds(), done.elapsed_seconds(), 1e-6);
    EXPECT_EQ(again.ledger().samples(), done.samples_done());
    EXPECT_THAT(again.ledger().problem(), IsEmpty());
    EXPECT_EQ(again.restarts(), 0u);
    EXPECT_EQ(Fetch(done.name()), image);
    EXPECT_EQ(Now(cancelled.name()).state(), v1::JOB_STATE_CANCELLED);

    // The same request makes no second job; whoever watched goes on.
    v1::Job twin;
    ASSERT_TRUE(Create(Spec(), &twin, "request-1").ok());
    EXPECT_EQ(twin.name(), done.name());
    ASSERT_TRUE(Watch(done.name(), before.back().event() + 1, &after).ok());
    ASSERT_FALSE(after.empty());
    EXPECT_GT(after.front().event(), before.back().event());
    EXPECT_EQ(after.back().job().state(), v1::JOB_STATE_SUCCEEDED);
}

TEST_F(RestartTest, AQueuedJobIsRendered) {
    const v1::Job expected = Undisturbed(Spec());
    const v1::Job job = MustCreate(Spec());
    Restart();
    EXPECT_EQ(Now(job.name()).state(), v1::JOB_STATE_QUEUED);
    const auto worker = StartWorker();
    const v1::Job done = WaitForEnd(job.name());
    EXPECT_EQ(done.image_sha256(), expected.image_sha256());
}

class RestartSamplers : public RestartTest, public testing::WithParamInterface<const char*> {};

TEST_P(RestartSamplers, ARenderingJobGoesOnToTheSameBits) {
    v1::JobSpec spec = Spec(GetParam());
    spec.set_spp(16);
    const v1::Job expected = Undisturbed(spec);
    for (const int results : {3, 12, 17}) {
        const v1::Job job = HalfDone(spec, results);
        const std::string name = job.name();
        Restart(Saving());
        const v1::Job loaded = Now(name);
        EXPECT_EQ(loaded.state(), v1::JOB_STATE_RENDERING);
        EXPECT_GT(loaded.samples_done(), 0u);
        EXPECT_EQ(loaded.restarts(), 1u);
        const auto worker = StartWorker();
        const v1::Job done = WaitForEnd(name);
        EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED) << done.message();
        EXPECT_EQ(done.image_sha256(), expected.image_sha256()) << results;
        EXPECT_EQ(done.samples_done(), expected.samples_done());
        EXPECT_EQ(done.ledger().film_samples(), expected.samples_done());
        EXPECT_THAT(done.ledger().problem(), IsEmpty());
    }
}

INSTANTIATE_TEST_SUITE_P(All, RestartSamplers,
                         testing::Values("uniform", "adaptive", "paper:mode=corrected"),
                         [](const auto& tested) { return std::string(tested.param).substr(0, 5); });

TEST_F(RestartTest, AJobWithATargetStopsAtTheSameSamples) {
    v1::JobSpec spec = Spec("adaptive");
    spec.set_filter("auto");
    spec.set_spp(128);
    spec.set_target(0.005);
    const v1::Job expected = Undisturbed(spec);
    const v1::Job job = HalfDone(spec, 20);
    Restart(Saving());
    EXPECT_GT(Now(job.name()).samples_done(), 0u);
    const auto worker = StartWorker();
    const v1::Job done = WaitForEnd(job.name());
    EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED) << done.message();
    EXPECT_EQ(done.samples_done(), expected.samples_done());
    EXPECT_EQ(done.image_sha256(), expected.image_sha256());
}

TEST_F(RestartTest, ASlowDiskHoldsUpTheCopyAndNothingElse) {
    v1::JobSpec spec = Spec("uniform", 8);
    spec.set_spp(256);
    const v1::Job expected = Undisturbed(spec);
    ServerOptions options = Saving(0.001);
    options.coordinator.films.max_waiting_bytes = 1;
    Restart(options);
    EXPECT_EQ(Undisturbed(spec).image_sha256(), expected.image_sha256());
    v1::Job job;
    {
        FakeWorkerOptions stalls;
        stalls.stall_after = 40;
        const auto worker = StartWorker(stalls);
        job = MustCreate(spec);
        worker->WaitForAcknowledged(1);
    }
    Restart(options);
    EXPECT_GT(Now(job.name()).samples_done(), 0u);
    const auto worker = StartWorker();
    EXPECT_EQ(WaitForEnd(job.name()).image_sha256(), expected.image_sha256());
}

TEST_F(RestartTest, AServerThatIsStoppedSavesWhatItHas) {
    const v1::Job expected = Undisturbed(Spec());
    Restart(Saving(1000));
    FakeWorkerOptions stalls;
    stalls.stall_after = 7;
    auto worker = StartWorker(stalls);
    const std::string name = MustCreate(Spec()).name();
    worker->WaitForLeases(8);
    const v1::Job before = WaitUntil(name, [](const v1::Job& j) {
        return j.samples_done() > 0 && j.workers_size() == 1 && j.workers(0).leases() == 7;
    });
    EXPECT_EQ(before.save_seconds(), 0);
    Restart(Saving(1000));
    worker.reset();
    EXPECT_EQ(Now(name).samples_done(), before.samples_done());
    const auto fresh = StartWorker();
    const v1::Job done = WaitForEnd(name);
    EXPECT_EQ(done.image_sha256(), expected.image_sha256());
    EXPECT_THAT(done.ledger().problem(), IsEmpty());
    // Nothing that was merged is rendered again.
    EXPECT_EQ(static_cast<std::uint64_t>(fresh->leases()) + 7, done.ledger().ranges());
}

TEST_F(RestartTest, ADamagedFilmIsPassedOverForTheOneBefore) {
    v1::JobSpec spec = Spec();
    spec.set_spp(16);
    const v1::Job expected = Undisturbed(spec);
    const v1::Job job = HalfDone(spec, 12);
    server.reset();
    const auto films = Films(job.name());
    ASSERT_FALSE(films.empty());
    ASSERT_LE(films.size(), 2u);
    fs::resize_file(films.back(), fs::file_size(films.back()) / 2);
    Restart(Saving());
    EXPECT_EQ(Now(job.name()).samples_done() > 0, films.size() == 2);
    const auto worker = StartWorker();
    const v1::Job done = WaitForEnd(job.name());
    EXPECT_EQ(done.image_sha256(), expected.image_sha256());
    server.reset();
    EXPECT_EQ(Films(job.name()).size(), 1u);  // the last one, and nothing else
}

TEST_F(RestartTest, WithoutAFilmAJobBeginsAnew) {
    const v1::Job expected = Undisturbed(Spec());
    Restart(Saving(0));
    FakeWorkerOptions stalls;
    stalls.stall_after = 4;
    v1::Job job;
    {
        const auto worker = StartWorker(stalls);
        job = MustCreate(Spec());
        worker->WaitForAcknowledged(4);  // at once, where nothing is saved
    }
    Restart(Saving(0));
    EXPECT_EQ(Now(job.name()).samples_done(), 0u);
    const auto worker = StartWorker();
    EXPECT_EQ(WaitForEnd(job.name()).image_sha256(), expected.image_sha256());
}

TEST_F(RestartTest, AnAnswerToALeaseOfTheServerBeforeIsTaken) {
    Restart(Saving());
    const v1::Job job = MustCreate(Spec());
    v1::WorkRequest answer;
    {
        WorkerHand hand(work.get());
        hand.Want(1);
        const v1::Lease lease = hand.TakeLease();
        answer = FakeWorker::Render(hand.context, lease, false);
    }
    Restart(Saving());
    WorkerHand hand(work.get());
    // Somebody has to ask for leases: the job begins anew with its first pass.
    WorkerHand other(work.get());
    other.Want(1);
    EXPECT_EQ(other.TakeLease().ticket(), answer.result().ticket());
    hand.Send(answer);
    const v1::Job taken =
        WaitUntil(job.name(), [](const v1::Job& j) { return j.samples_done() > 0; });
    ASSERT_EQ(taken.workers_size(), 1);
    EXPECT_THAT(taken.workers(0).worker(), HasSubstr("hand"));

    // Twice is once.
    hand.Send(answer);
    const v1::Job twice =
        WaitUntil(job.name(), [](const v1::Job& j) { return j.results_duplicate() > 0; });
    EXPECT_EQ(twice.samples_done(), taken.samples_done());
}

TEST_F(RestartTest, AnAnswerThatNobodyEverAskedForIsDropped) {
    const v1::Job job = MustCreate(Spec());
    WorkerHand hand(work.get());
    hand.Want(2);
    const v1::Lease first = hand.TakeLease();
    v1::WorkRequest forged = FakeWorker::Render(hand.context, first, false);
    const v1::Lease second = hand.TakeLease();
    forged.mutable_result()->set_lease_id(1000);
    forged.mutable_result()->set_unit(second.unit());  // with the ticket of the first
    hand.Send(forged);
    forged.mutable_result()->set_ticket(std::string(32, 'a'));
    hand.Send(forged);
    forged.mutable_result()->set_unit(~std::uint64_t{0});
    hand.Send(forged);
    const v1::Job after =
        WaitUntil(job.name(), [](const v1::Job& j) { return j.results_duplicate() == 3; });
    EXPECT_EQ(after.samples_done(), 0u);
}

TEST_F(RestartTest, AJobIsExtended) {
    v1::JobSpec spec = Spec();
    const v1::Job larger = [&] {
        v1::JobSpec more = spec;
        more.set_spp(32);
        return Undisturbed(more);
    }();
    Restart(Saving());
    const v1::Job job = Undisturbed(spec);
    const auto extend = [&](double spp, v1::Job* answer) {
        grpc::ClientContext context;
        v1::ExtendJobRequest request;
        request.set_name(job.name());
        request.set_spp(spp);
        v1::ExtendJobResponse response;
        const auto status = jobs->ExtendJob(&context, request, &response);
        *answer = response.job();
        return status;
    };
    v1::Job extended;
    EXPECT_EQ(extend(8, &extended).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    WaitUntil(job.name(), [](const v1::Job& j) { return j.save_seconds() > 0; });
    const auto status = extend(32, &extended);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(extended.state(), v1::JOB_STATE_RENDERING);
    EXPECT_EQ(extended.spec().spp(), 32);
    EXPECT_EQ(extend(64, &extended).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
    Restart(Saving());  // and this server's successor has not forgotten it
    const auto worker = StartWorker();
    const v1::Job done = WaitForEnd(job.name());
    EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED) << done.message();
    EXPECT_EQ(done.samples_done(), larger.samples_done());
    EXPECT_EQ(done.image_sha256(), larger.image_sha256());
    EXPECT_THAT(done.ledger().problem(), IsEmpty());
}

TEST_F(RestartTest, OfAFilmThatIsNotKeptAJobCanNotBeExtended) {
    Restart(Saving(0));
    const v1::Job job = Undisturbed(Spec());
    grpc::ClientContext context;
    v1::ExtendJobRequest request;
    request.set_name(job.name());
    request.set_spp(32);
    v1::ExtendJobResponse response;
    const auto status = jobs->ExtendJob(&context, request, &response);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
    EXPECT_THAT(status.error_message(), HasSubstr("--spp"));
    EXPECT_EQ(Now(job.name()).state(), v1::JOB_STATE_SUCCEEDED);
}

TEST_F(RestartTest, FilmsOfThoseOverStayWithinTheirQuota) {
    ServerOptions options = Saving();
    options.coordinator.films.quota = 700'000;  // a film of 48 x 40 pixels has 330 KB
    Restart(options);
    for (int i = 0; i < 4; ++i) {
        const v1::Job job = Undisturbed(Spec());
        WaitUntil(job.name(), [](const v1::Job& j) { return j.save_seconds() > 0; });
    }
    WaitFor([&] { return Films().size() <= 2; });
    EXPECT_EQ(Films().size(), 2u);
}

TEST_F(RestartTest, OnAFullDiskAJobPausesAndGoesOnWhenThereIsRoom) {
    v1::JobSpec spec = Spec();
    spec.set_spp(64);
    const v1::Job expected = Undisturbed(spec);
    const auto disk = std::make_shared<test::FailingDisk>();
    ServerOptions options = Saving();
    options.coordinator.disk = disk;
    Restart(options);
    FakeWorkerOptions stalls;
    stalls.stall_after = 3;
    auto worker = StartWorker(stalls);
    disk->full = true;
    const v1::Job job = MustCreate(spec);
    const v1::Job held = WaitUntil(job.name(), [](const v1::Job& j) { return !j.held().empty(); });
    EXPECT_EQ(held.state(), v1::JOB_STATE_RENDERING);
    EXPECT_THAT(held.held(), HasSubstr("free some space"));
    worker = StartWorker();
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    EXPECT_EQ(worker->leases(), 0);
    disk->full = false;
    std::vector<v1::WatchJobResponse> events;
    ASSERT_TRUE(Watch(job.name(), 0, &events).ok());
    const v1::Job& done = events.back().job();
    EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED) << done.message();
    EXPECT_THAT(done.held(), IsEmpty());
    EXPECT_EQ(done.image_sha256(), expected.image_sha256());
    EXPECT_TRUE(std::any_of(events.begin(), events.end(),
                            [](const auto& e) { return !e.job().held().empty(); }));
}

TEST_F(RestartTest, AnImageThatFindsNoRoomIsKeptUntilThereIs) {
    const v1::Job expected = Undisturbed(Spec());
    const auto disk = std::make_shared<test::FailingDisk>();
    disk->full = true;
    ServerOptions options = Saving(0);
    options.coordinator.disk = disk;
    Restart(options);
    const auto worker = StartWorker();
    const v1::Job job = MustCreate(Spec());
    const v1::Job held = WaitUntil(job.name(), [](const v1::Job& j) { return !j.held().empty(); });
    EXPECT_EQ(held.state(), v1::JOB_STATE_FILTERING);
    disk->full = false;
    const v1::Job done = WaitForEnd(job.name());
    EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED) << done.message();
    EXPECT_EQ(done.image_sha256(), expected.image_sha256());
    EXPECT_FALSE(Fetch(job.name()).empty());
}

TEST_F(RestartTest, TimeThatWasUsedCountsAfterARestart) {
    v1::JobSpec spec = Spec();
    spec.clear_spp();
    spec.set_time_limit(2.5);
    const v1::Job job = HalfDone(spec, 6);
    WaitUntil(job.name(), [](const v1::Job& j) { return j.elapsed_seconds() > 0; });
    std::this_thread::sleep_for(std::chrono::milliseconds(1200));
    Restart(Saving());
    const v1::Job loaded = Now(job.name());
    EXPECT_GT(loaded.elapsed_seconds(), 0.9);
    EXPECT_EQ(loaded.create_time().seconds(), job.create_time().seconds());
    const auto worker = StartWorker();
    const v1::Job done = WaitForEnd(job.name());
    EXPECT_EQ(done.stop_reason(), v1::STOP_REASON_TIME_LIMIT);
    EXPECT_LT(done.elapsed_seconds(), 4);
}

}  // namespace
}  // namespace relume::server
