#include <gmock/gmock.h>

#include <cmath>
#include <cstring>

#include "tests/integration/rpc/farm_fixture.h"

namespace relume::server {
namespace {

using testing::Contains;
using testing::HasSubstr;

class WorkServiceTest : public FarmFixture {
  protected:
    std::string Digest(const v1::JobSpec& spec) {
        const v1::Job job = WaitForEnd(MustCreate(spec).name());
        EXPECT_EQ(job.state(), v1::JOB_STATE_SUCCEEDED) << job.message();
        EXPECT_EQ(job.image_sha256().size(), 64u);
        return job.image_sha256();
    }
};

TEST_F(WorkServiceTest, AWorkerOfAnotherVersionIsRefusedWithBothNamed) {
    const auto status = StartWorker({.version = kProtocolVersion + 41})->Join();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
    EXPECT_THAT(status.error_message(), HasSubstr(std::to_string(kProtocolVersion + 41)));
    EXPECT_THAT(status.error_message(), HasSubstr("version " + std::to_string(kProtocolVersion)));
}

TEST_F(WorkServiceTest, AWorkerOfAnotherBuildIsRefusedWithBothNamed) {
    const auto status = StartWorker({.build = "relume 9.9.9\x1b"})->Join();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
    EXPECT_THAT(status.error_message(), HasSubstr("relume 9.9.9 "));
    EXPECT_THAT(status.error_message(), HasSubstr(kBuild));
}

TEST_F(WorkServiceTest, WorkersHearOfEachJobThatIsOver) {
    const auto worker = StartWorker();
    Digest(Spec());
    Digest(Spec());
    worker->WaitForJobsOver(2);
}

TEST_F(WorkServiceTest, TheFirstMessageMustBeHello) {
    grpc::ClientContext context;
    const auto stream = work->Work(&context);
    v1::WorkRequest report;
    report.mutable_report()->set_credits(1);
    stream->Write(report);
    v1::WorkResponse response;
    EXPECT_FALSE(stream->Read(&response));
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(WorkServiceTest, AJobGetsRenderedAndTheDigestDependsOnNothingButTheJob) {
    std::string digest;
    {
        const auto worker = StartWorker();
        digest = Digest(Spec("paper", 32));
    }
    const auto one = StartWorker(), two = StartWorker(), three = StartWorker({.credits = 1});
    for (const int tile_size : {8, 16, 64}) {
        EXPECT_EQ(Digest(Spec("paper", tile_size)), digest);
    }
    v1::JobSpec other = Spec("paper");
    other.set_spp(9);
    EXPECT_NE(Digest(other), digest);
}

TEST_F(WorkServiceTest, AWorkerThatDiesInTheMiddleChangesNothing) {
    std::string digest;
    {
        const auto worker = StartWorker();
        digest = Digest(Spec("paper"));
    }
    const v1::Job job = MustCreate(Spec("paper"));
    for (int i = 0; i < 3; ++i) {
        EXPECT_FALSE(StartWorker({.die_after = 2})->Join().ok());
    }
    const auto worker = StartWorker();
    const v1::Job done = WaitForEnd(job.name());
    EXPECT_EQ(done.image_sha256(), digest);
    EXPECT_GT(done.leases_reissued(), 0u);
    std::uint64_t samples = 0;
    for (const auto& share : done.workers()) {
        samples += share.samples();
    }
    EXPECT_EQ(samples, done.samples_done());
}

TEST_F(WorkServiceTest, AWrongResultIsNotTakenAndItsWorkerNamed) {
    std::string digest;
    {
        const auto worker = StartWorker();
        digest = Digest(Spec());
    }
    const v1::Job job = MustCreate(Spec());
    const auto odd = StartWorker({.name = "odd", .wrong_until = 1});
    const v1::Job done = WaitForEnd(job.name());
    EXPECT_EQ(done.image_sha256(), digest);
    EXPECT_THAT(done.notes(), Contains(HasSubstr("worker odd: wrong result")));
    EXPECT_EQ(done.leases_reissued(), 1u);
}

TEST_F(WorkServiceTest, AResultThatChangedOnTheWayIsNotTaken) {
    std::string digest;
    {
        const auto worker = StartWorker();
        digest = Digest(Spec());
    }
    const v1::Job job = MustCreate(Spec());
    const auto garbled = StartWorker({.name = "garbled", .garbled_until = 2});
    const v1::Job done = WaitForEnd(job.name());
    EXPECT_EQ(done.image_sha256(), digest);
    EXPECT_THAT(done.notes(), Contains(testing::AllOf(HasSubstr("worker garbled: wrong result"),
                                                      HasSubstr("checksum of its contents"))));
    EXPECT_GE(done.leases_reissued(), 2u);
}

TEST_F(WorkServiceTest, AnAnswerToALeaseThatChangedOnTheWayIsNotTaken) {
    std::string digest;
    {
        const auto worker = StartWorker();
        digest = Digest(Spec());
    }
    const v1::Job job = MustCreate(Spec());
    const auto misreads = StartWorker({.name = "misreads", .misread_until = 2});
    const v1::Job done = WaitForEnd(job.name());
    EXPECT_EQ(done.image_sha256(), digest);
    EXPECT_THAT(done.notes(), Contains(testing::AllOf(HasSubstr("worker misreads: wrong result"),
                                                      HasSubstr("checksum of its task"))));
    EXPECT_GE(done.leases_reissued(), 2u);
}

TEST_F(WorkServiceTest, AResultWithoutAllSamplesIsNotTakenAndItsWorkerNamed) {
    v1::JobSpec spec = Spec();
    spec.set_filter("rpf:neighbours=64");
    spec.set_keep_samples(true);
    std::string digest;
    {
        const auto worker = StartWorker();
        digest = Digest(spec);
    }
    const v1::Job job = MustCreate(spec);
    const auto odd = StartWorker({.name = "odd", .short_until = 1});
    const v1::Job done = WaitForEnd(job.name());
    EXPECT_EQ(done.image_sha256(), digest);
    EXPECT_THAT(done.notes(), Contains(testing::AllOf(HasSubstr("worker odd: wrong result"),
                                                      HasSubstr("samples"), HasSubstr("are due"))));
    EXPECT_EQ(done.leases_reissued(), 1u);
}

TEST_F(WorkServiceTest, ASceneThatDoesNotLoadEndsTheJobWithTheWorkersWords) {
    const auto worker = StartWorker({.problem = "scene.gltf: byte 0:\nnot glTF"});
    const v1::Job job = WaitForEnd(MustCreate(Spec()).name());
    EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
    EXPECT_EQ(job.message(), "scene.gltf: byte 0: not glTF");
}

TEST_F(WorkServiceTest, TransportOfJunkDoesNoHarm) {
    const auto worker = StartWorker();
    grpc::ClientContext context;
    const auto stream = work->Work(&context);
    v1::WorkRequest message;
    message.mutable_hello()->set_protocol_version(kProtocolVersion);
    message.mutable_hello()->mutable_numeric_class()->set_build(kBuild);
    message.mutable_hello()->set_threads(-7);
    stream->Write(message);
    message.mutable_result()->set_lease_id(77);
    message.mutable_result()->set_job("jobs/none");
    stream->Write(message);
    message.mutable_lease_return()->add_lease_ids(~0ull);
    stream->Write(message);
    message.mutable_problem()->set_job("jobs/none");
    stream->Write(message);
    message.mutable_scene_ready()->set_job("jobs/none");
    stream->Write(message);
    message.mutable_report()->set_credits(0);
    stream->Write(message);
    stream->Write(v1::WorkRequest());
    Digest(Spec());
    stream->WritesDone();
    v1::WorkResponse response;
    while (stream->Read(&response)) {
    }
    EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(WorkServiceTest, AnyAnswerToALeaseThatIsNotItsAnswerDoesNoHarm) {
    std::string digest;
    {
        const auto worker = StartWorker();
        digest = Digest(Spec());
    }
    const v1::Job job = MustCreate(Spec());
    grpc::ClientContext context;
    const auto stream = work->Work(&context);
    v1::WorkRequest message;
    message.mutable_hello()->set_protocol_version(kProtocolVersion);
    message.mutable_hello()->mutable_numeric_class()->set_build(kBuild);
    message.mutable_hello()->mutable_numeric_class()->set_isa("avx2");
    message.mutable_hello()->set_name("hostile");
    stream->Write(message);
    message.mutable_report()->set_credits(~0u);
    stream->Write(message);
    v1::WorkResponse response;
    v1::JobContext context_sent;
    while (stream->Read(&response) && !response.has_lease()) {
        if (response.has_job()) {
            context_sent = response.job();
        }
    }
    const v1::Lease lease = response.lease();
    const TileTask task = codec::TaskFromLease(lease);
    const std::uint64_t task_digest =
        FakeWorker::Render(context_sent, lease, false).result().task_digest();
    std::uint64_t random = 1;
    const auto next = [&] { return random = Mix(random); };
    const std::string right = codec::EncodePlanes(PseudoRender(task));
    for (int i = 0; i < 300; ++i) {
        v1::LeaseResult* result = message.mutable_result();
        // Mostly of this lease, so that it is refused until the job gives it up to nobody.
        result->set_lease_id(next() % 4 == 0 ? next() % 64 : lease.id());
        result->set_job(next() % 8 == 0 ? "jobs/none" : job.name());
        result->set_epoch(next() % 2 == 0 ? lease.epoch() : static_cast<std::uint32_t>(next()));
        std::string planes = right;
        switch (next() % 4) {
            case 0:
                planes.resize(next() % (2 * right.size()));
                break;
            case 1:
                planes.clear();
                break;
            default:
                // Wrong counts at the least.
                for (std::size_t k = 0; k < planes.size(); k += 1 + next() % 64) {
                    planes[k] = static_cast<char>(next());
                }
                planes[3] = static_cast<char>(0xff);
        }
        result->set_planes(planes);
        result->set_rays(next());
        const double seconds[] = {-1, 0, 1e300, NAN, INFINITY};
        result->set_seconds(seconds[next() % 5]);
        // Mostly with checksums that are right.
        if (next() % 8 != 0) {
            TileResult read;
            read.planes.resize(planes.size() / sizeof(float));
            std::memcpy(read.planes.data(), planes.data(), read.planes.size() * sizeof(float));
            read.rays = result->rays();
            read.seconds = result->seconds();
            codec::SetDigests(task_digest, read, result);
        }
        stream->Write(message);
    }
    message.mutable_result()->set_planes(std::string(5 << 20, 'x'));
    stream->Write(message);  // beyond the message limit: ends this stream
    while (stream->Read(&response)) {
    }
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    v1::Job now;
    ASSERT_TRUE(Get(job.name(), &now).ok());
    EXPECT_THAT(now.notes().empty() ? now.message() : now.notes(0), HasSubstr("worker hostile"));
    EXPECT_EQ(now.samples_done(), 0u);
    const auto worker = StartWorker();
    EXPECT_EQ(Digest(Spec()), digest);
}

TEST_F(WorkServiceTest, WorkersAreListedWithWhatIsKnownOfThem) {
    const auto worker = StartWorker({.name = "box"});
    Digest(Spec());
    grpc::ClientContext context;
    v1::ListWorkersResponse response;
    ASSERT_TRUE(jobs->ListWorkers(&context, {}, &response).ok());
    ASSERT_EQ(response.workers_size(), 1);
    EXPECT_EQ(response.workers(0).name(), "box");
    EXPECT_EQ(response.workers(0).numeric_class().isa(), "avx2");
    EXPECT_EQ(response.workers(0).numeric_class().build(), kBuild);
    EXPECT_EQ(response.workers(0).threads(), 1);
    EXPECT_EQ(response.workers(0).leases_held(), 0u);
    EXPECT_EQ(response.workers(0).samples_done(), 48u * 40u * 8u);
    EXPECT_GT(response.workers(0).samples_per_second(), 0);
}

}  // namespace
}  // namespace relume::server
