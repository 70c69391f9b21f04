// Priorities, pausing, resuming and cancelling of jobs over gRPC, and what of it outlives a server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/image/exr.h"
#include "tests/integration/rpc/farm_fixture.h"

namespace relume::server {
namespace {

using Code = grpc::StatusCode;
using testing::HasSubstr;

class JobControlTest : public FarmFixture {
  protected:
    static ServerOptions Saving() {
        ServerOptions options;
        options.coordinator.films.save_seconds = 0.01;
        return options;
    }
    template <typename Request, typename Response, typename Call>
    static grpc::Status Ask(Request request, Call call, v1::Job* job) {
        grpc::ClientContext context;
        Response response;
        const auto status = call(&context, request, &response);
        *job = response.job();
        return status;
    }
    grpc::Status Pause(const std::string& name, v1::Job* job) {
        v1::PauseJobRequest request;
        request.set_name(name);
        return Ask<v1::PauseJobRequest, v1::PauseJobResponse>(
            request,
            [&](auto* context, const auto& r, auto* response) {
                return jobs->PauseJob(context, r, response);
            },
            job);
    }
    grpc::Status Resume(const std::string& name, v1::Job* job) {
        v1::ResumeJobRequest request;
        request.set_name(name);
        return Ask<v1::ResumeJobRequest, v1::ResumeJobResponse>(
            request,
            [&](auto* context, const auto& r, auto* response) {
                return jobs->ResumeJob(context, r, response);
            },
            job);
    }
    grpc::Status Update(const std::string& name, std::optional<int> priority, v1::Job* job) {
        v1::UpdateJobRequest request;
        request.set_name(name);
        if (priority) {
            request.set_priority(*priority);
        }
        return Ask<v1::UpdateJobRequest, v1::UpdateJobResponse>(
            request,
            [&](auto* context, const auto& r, auto* response) {
                return jobs->UpdateJob(context, r, response);
            },
            job);
    }
    grpc::Status Discard(const std::string& name, v1::Job* job) {
        v1::CancelJobRequest request;
        request.set_name(name);
        request.set_discard(true);
        return Ask<v1::CancelJobRequest, v1::CancelJobResponse>(
            request,
            [&](auto* context, const auto& r, auto* response) {
                return jobs->CancelJob(context, r, response);
            },
            job);
    }
    // A job that takes for ever, with some samples.
    v1::Job Endless() {
        v1::JobSpec spec = Spec();
        spec.set_spp(1 << 20);
        return WaitUntil(MustCreate(spec).name(),
                         [](const v1::Job& job) { return job.samples_done() > 0; });
    }
};

TEST_F(JobControlTest, APausedJobLeavesTheFarmToOthers) {
    const auto worker = StartWorker();
    v1::Job job = Endless();
    EXPECT_TRUE(job.has_share());
    ASSERT_TRUE(Pause(job.name(), &job).ok());
    EXPECT_TRUE(job.paused());
    EXPECT_EQ(job.state(), v1::JOB_STATE_RENDERING);
    EXPECT_FALSE(job.has_share());
    // Leases that were out before this one are answered by its end.
    EXPECT_EQ(WaitForEnd(MustCreate(Spec()).name()).state(), v1::JOB_STATE_SUCCEEDED);
    const std::uint64_t samples = Now(job.name()).samples_done();
    EXPECT_EQ(WaitForEnd(MustCreate(Spec()).name()).state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(Now(job.name()).samples_done(), samples);
    ASSERT_TRUE(Pause(job.name(), &job).ok()) << "once more";
    ASSERT_TRUE(Resume(job.name(), &job).ok());
    EXPECT_FALSE(job.paused());
    WaitUntil(job.name(), [&](const v1::Job& j) { return j.samples_done() > samples; });
    ASSERT_TRUE(Resume(job.name(), &job).ok()) << "once more";
    // Watchers are told.
    ASSERT_TRUE(Discard(job.name(), &job).ok());
    std::vector<v1::WatchJobResponse> events;
    ASSERT_TRUE(Watch(job.name(), 0, &events).ok());
    EXPECT_EQ(events.back().job().state(), v1::JOB_STATE_CANCELLED);
    EXPECT_FALSE(events.back().job().paused());
}

TEST_F(JobControlTest, AHigherPriorityComesFirst) {
    const auto worker = StartWorker();
    v1::Job low = Endless();
    v1::JobSpec spec = Spec();
    spec.set_priority(-5);
    v1::Job lower = MustCreate(spec);
    EXPECT_EQ(lower.spec().priority(), -5);
    spec.set_priority(1);
    EXPECT_EQ(WaitForEnd(MustCreate(spec).name()).state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(Now(lower.name()).state(), v1::JOB_STATE_QUEUED);
    ASSERT_TRUE(Update(lower.name(), {}, &lower).ok());
    EXPECT_EQ(lower.spec().priority(), -5);
    ASSERT_TRUE(Update(lower.name(), 100, &lower).ok());
    EXPECT_EQ(lower.spec().priority(), 100);
    EXPECT_EQ(WaitForEnd(lower.name()).state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(Now(low.name()).state(), v1::JOB_STATE_RENDERING);
    ASSERT_TRUE(Discard(low.name(), &low).ok());
}

TEST_F(JobControlTest, WhatCantBeDoneIsRefusedWithAReason) {
    v1::Job job;
    v1::JobSpec spec = Spec();
    spec.set_priority(101);
    auto status = Create(spec, &job);
    EXPECT_EQ(status.error_code(), Code::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), HasSubstr("must be -100 to 100"));
    spec.set_priority(0);
    spec.set_owner(std::string(65, 'x'));
    EXPECT_EQ(Create(spec, &job).error_code(), Code::INVALID_ARGUMENT);
    job = MustCreate(Spec());
    v1::Job other;
    EXPECT_EQ(Update(job.name(), -101, &other).error_code(), Code::INVALID_ARGUMENT);
    for (const char* name : {"jobs/none", "", "../../etc"}) {
        EXPECT_EQ(Pause(name, &other).error_code(), Code::NOT_FOUND);
        EXPECT_EQ(Resume(name, &other).error_code(), Code::NOT_FOUND);
        EXPECT_EQ(Update(name, 1, &other).error_code(), Code::NOT_FOUND);
        EXPECT_EQ(Update(name, {}, &other).error_code(), Code::NOT_FOUND);
    }
    ASSERT_TRUE(Cancel(job.name(), &job).ok());
    EXPECT_EQ(job.state(), v1::JOB_STATE_CANCELLED) << "there is no sample";
    EXPECT_EQ(Pause(job.name(), &other).error_code(), Code::FAILED_PRECONDITION);
    EXPECT_EQ(Resume(job.name(), &other).error_code(), Code::FAILED_PRECONDITION);
    EXPECT_EQ(Update(job.name(), 1, &other).error_code(), Code::FAILED_PRECONDITION);
}

TEST_F(JobControlTest, TheOwnerIsWhoTheClientSaysElseItsAddress) {
    v1::JobSpec spec = Spec();
    EXPECT_EQ(MustCreate(spec).spec().owner(), "127.0.0.1");
    spec.set_owner("ann@desk\x1b[31m");
    EXPECT_EQ(MustCreate(spec).spec().owner(), "ann@desk?[31m");
}

TEST_F(JobControlTest, ACancelledJobHasAnImageAndCanBeTakenUpAgain) {
    Restart(Saving());
    v1::JobSpec spec = Spec();
    spec.set_spp(256);
    const v1::Job whole = Undisturbed(spec);
    v1::Job job;
    {
        FakeWorkerOptions stalls;
        stalls.stall_after = 20;
        const auto worker = StartWorker(stalls);
        job = MustCreate(spec);
        job = WaitUntil(job.name(), [](const v1::Job& j) { return j.samples_done() > 48 * 40; });
        ASSERT_TRUE(Pause(job.name(), &job).ok());
        ASSERT_TRUE(Cancel(job.name(), &job).ok());
    }
    EXPECT_EQ(job.stop_reason(), v1::STOP_REASON_CANCELLED);
    job = WaitForEnd(job.name());
    EXPECT_EQ(job.state(), v1::JOB_STATE_CANCELLED);
    EXPECT_GT(job.result_size(), 0u);
    EXPECT_LT(job.samples_done(), whole.samples_done());
    const std::string bytes = Fetch(job.name());
    EXPECT_EQ(bytes.size(), job.result_size());
    const TemporaryFolder results;
    WriteFileAtomically(results.path() / "image.exr", bytes);
    const Image image = ReadExr(results.path() / "image.exr");
    EXPECT_EQ(image.metadata().at("relume.unfinished"), "cancelled");
    double samples = 0;
    for (const float n : image.Plane("samples.Y")) {
        samples += n;
    }
    EXPECT_NEAR(samples + static_cast<double>(job.bad_samples()),
                static_cast<double>(job.samples_done()), 0.5);

    Restart(Saving());  // it is there after a restart, too
    EXPECT_EQ(Now(job.name()).result_size(), job.result_size());
    EXPECT_EQ(Fetch(job.name()), bytes);
    {
        grpc::ClientContext context;
        v1::ExtendJobRequest request;
        request.set_name(job.name());
        request.set_spp(256);
        v1::ExtendJobResponse response;
        const auto status = jobs->ExtendJob(&context, request, &response);
        ASSERT_TRUE(status.ok()) << status.error_message();
    }
    const auto worker = StartWorker();
    job = WaitForEnd(job.name());
    EXPECT_EQ(job.state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(job.image_sha256(), whole.image_sha256());
    EXPECT_EQ(job.ledger().problem(), "");
}

TEST_F(JobControlTest, APauseAndAPriorityOutliveTheServer) {
    v1::JobSpec spec = Spec("adaptive");
    spec.set_spp(16);
    const v1::Job whole = Undisturbed(spec);
    Restart(Saving());
    v1::Job job, queued;
    {
        FakeWorkerOptions stalls;
        stalls.stall_after = 10;
        const auto worker = StartWorker(stalls);
        job = MustCreate(spec);
        WaitUntil(job.name(), [](const v1::Job& j) { return j.samples_done() > 0; });
        ASSERT_TRUE(Pause(job.name(), &job).ok());
        ASSERT_TRUE(Update(job.name(), 7, &job).ok());
    }
    queued = MustCreate(spec);
    ASSERT_TRUE(Pause(queued.name(), &queued).ok());
    for (int i = 0; i < 2; ++i) {
        Restart(Saving());
        EXPECT_TRUE(Now(job.name()).paused());
        EXPECT_EQ(Now(job.name()).spec().priority(), 7);
        EXPECT_TRUE(Now(queued.name()).paused());
        EXPECT_EQ(Now(queued.name()).state(), v1::JOB_STATE_QUEUED);
    }
    const auto worker = StartWorker();
    EXPECT_EQ(WaitForEnd(MustCreate(Spec()).name()).state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_TRUE(Now(job.name()).paused());
    for (const auto& name : {job.name(), queued.name()}) {
        ASSERT_TRUE(Resume(name, &job).ok());
        job = WaitForEnd(name);
        EXPECT_EQ(job.state(), v1::JOB_STATE_SUCCEEDED);
        EXPECT_EQ(job.image_sha256(), whole.image_sha256());
    }
}

}  // namespace
}  // namespace relume::server
