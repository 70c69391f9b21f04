#include <gmock/gmock.h>

#include <cmath>

#include "proto/codec/codec.h"
#include "tests/integration/rpc/farm_fixture.h"

namespace relume::server {
namespace {

using Code = grpc::StatusCode;
using testing::HasSubstr;

class JobServiceTest : public FarmFixture {
  protected:
    grpc::Status List(int page_size, const std::string& token, v1::ListJobsResponse* response) {
        grpc::ClientContext context;
        v1::ListJobsRequest request;
        request.set_page_size(page_size);
        request.set_page_token(token);
        return jobs->ListJobs(&context, request, response);
    }
    grpc::Status Fetch(const std::string& name, std::uint64_t offset, std::string* bytes,
                       v1::FetchResultResponse* last) {
        grpc::ClientContext context;
        v1::FetchResultRequest request;
        request.set_name(name);
        request.set_offset(offset);
        const auto reader = jobs->FetchResult(&context, request);
        while (reader->Read(last)) {
            EXPECT_EQ(last->offset(), offset + bytes->size());
            EXPECT_LE(last->ByteSizeLong(), codec::kMaxChunk);
            *bytes += last->data();
        }
        return reader->Finish();
    }
};

TEST_F(JobServiceTest, AJobIsMadeWatchedAndFetched) {
    v1::JobSpec spec = Spec();
    spec.set_owner("ann@desk");
    const v1::Job made = MustCreate(spec);
    EXPECT_THAT(made.name(), testing::StartsWith("jobs/"));
    EXPECT_EQ(made.state(), v1::JOB_STATE_QUEUED);
    EXPECT_EQ(made.spec().SerializeAsString(), spec.SerializeAsString());
    EXPECT_EQ(made.samples_budget(), 48u * 40u * 8u);

    const auto worker = StartWorker();
    std::vector<v1::WatchJobResponse> events;
    ASSERT_TRUE(Watch(made.name(), 0, &events).ok());
    ASSERT_GE(events.size(), 4u);
    for (std::size_t i = 0; i < events.size(); ++i) {
        EXPECT_EQ(events[i].event(), i + 1);
        EXPECT_EQ(events[i].job().spec().scene().entries_size(), 0);
    }
    const v1::Job& done = events.back().job();
    EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED) << done.message();
    EXPECT_EQ(done.message(), "sample budget spent");
    EXPECT_EQ(done.samples_done(), made.samples_budget());
    EXPECT_EQ(done.passes_size(), 2);
    EXPECT_GT(done.relmse(), 0);
    EXPECT_GT(done.bad_samples(), 0u);
    EXPECT_EQ(done.rays(), 3 * done.samples_done());
    EXPECT_EQ(done.filter().filter(), "none");
    EXPECT_EQ(done.scene_sha256().size(), 64u);
    EXPECT_THAT(done.notes(), testing::ElementsAre("pretended"));
    EXPECT_GE(done.end_time().seconds(), done.create_time().seconds());

    // From the middle on, and once it is over.
    std::vector<v1::WatchJobResponse> late;
    ASSERT_TRUE(Watch(made.name(), events.back().event(), &late).ok());
    ASSERT_EQ(late.size(), 1u);
    EXPECT_EQ(late[0].job().image_sha256(), done.image_sha256());
    late.clear();
    ASSERT_TRUE(Watch(made.name(), events.back().event() + 1, &late).ok());
    EXPECT_TRUE(late.empty());

    std::string bytes, rest;
    v1::FetchResultResponse last;
    ASSERT_TRUE(Fetch(made.name(), 0, &bytes, &last).ok());
    EXPECT_EQ(bytes.size(), done.result_size());
    EXPECT_EQ(last.size(), bytes.size());
    EXPECT_EQ(last.sha256(), Sha256Hex(bytes));
    EXPECT_EQ(bytes.substr(0, 4), "\x76\x2f\x31\x01");  // OpenEXR's magic number
    ASSERT_TRUE(Fetch(made.name(), 100, &rest, &last).ok());
    EXPECT_TRUE(rest == bytes.substr(100));
    rest.clear();
    ASSERT_TRUE(Fetch(made.name(), bytes.size(), &rest, &last).ok());
    EXPECT_EQ(rest, "");
    EXPECT_EQ(last.sha256(), Sha256Hex(bytes));
    EXPECT_EQ(Fetch(made.name(), bytes.size() + 1, &rest, &last).error_code(),
              Code::INVALID_ARGUMENT);
}

TEST_F(JobServiceTest, ARepeatedRequestMakesOneJob) {
    v1::Job first, second, third;
    ASSERT_TRUE(Create(Spec(), &first, "6c0d6a1e").ok());
    ASSERT_TRUE(Create(Spec(), &second, "6c0d6a1e").ok());
    ASSERT_TRUE(Create(Spec(), &third, "another").ok());
    EXPECT_EQ(first.name(), second.name());
    EXPECT_NE(first.name(), third.name());
    EXPECT_NE(MustCreate(Spec()).name(), MustCreate(Spec()).name());
}

TEST_F(JobServiceTest, ValidateOnlyMakesNothing) {
    v1::Job job;
    ASSERT_TRUE(Create(Spec(), &job, "", true).ok());
    EXPECT_EQ(job.name(), "");
    v1::ListJobsResponse list;
    ASSERT_TRUE(List(0, "", &list).ok());
    EXPECT_EQ(list.jobs_size(), 0);
    v1::JobSpec bad = Spec();
    bad.set_spp(-1);
    EXPECT_EQ(Create(bad, &job, "", true).error_code(), Code::INVALID_ARGUMENT);
}

TEST_F(JobServiceTest, DefaultsAreFilledInForWorkers) {
    v1::JobSpec spec = Spec();
    spec.clear_sampler();
    spec.clear_filter();
    spec.clear_tile_size();
    const auto worker = StartWorker();
    const v1::Job job = WaitForEnd(MustCreate(spec).name());
    EXPECT_EQ(job.state(), v1::JOB_STATE_SUCCEEDED) << job.message();
    EXPECT_EQ(job.spec().sampler(), "");
}

TEST_F(JobServiceTest, SpecsThatMakeNoSenseAreAnsweredAndTheServerLives) {
    const auto expect = [&](Code code, const std::string& said,
                            const std::function<void(v1::JobSpec*)>& change) {
        v1::JobSpec spec = Spec();
        change(&spec);
        v1::Job job;
        const auto status = Create(spec, &job);
        EXPECT_EQ(status.error_code(), code) << said;
        EXPECT_THAT(status.error_message(), HasSubstr(said));
        EXPECT_THAT(status.error_message(), testing::Not(HasSubstr("\n")));
    };
    const Code bad = Code::INVALID_ARGUMENT;
    expect(bad, "size 0x0", [](auto* s) { s->Clear(); });
    expect(bad, "size 0x40", [](auto* s) { s->mutable_settings()->set_width(0); });
    expect(bad, "size 1000000000x",
           [](auto* s) { s->mutable_settings()->set_width(1'000'000'000); });
    expect(bad, "crop", [](auto* s) { s->mutable_settings()->mutable_crop()->set_x1(1'000); });
    expect(bad, "spp 0: the job has no budget", [](auto* s) { s->set_spp(0); });
    expect(bad, "target 0", [](auto* s) { s->set_target(0); });
    expect(bad, "time-limit nan", [](auto* s) { s->set_time_limit(std::nan("")); });
    expect(bad, "min-spp 9 is more than max-spp 8", [](auto* s) {
        s->set_min_spp(9);
        s->set_max_spp(8);
    });
    expect(bad, "spp -8", [](auto* s) { s->set_spp(-8); });
    expect(bad, "spp nan", [](auto* s) { s->set_spp(std::nan("")); });
    expect(bad, "spp inf", [](auto* s) { s->set_spp(INFINITY); });
    expect(bad, "less than one sample", [](auto* s) { s->set_spp(1e-9); });
    expect(bad, "tile size 65", [](auto* s) { s->set_tile_size(65); });
    expect(bad, "tile size -1", [](auto* s) { s->set_tile_size(-1); });
    expect(bad, "known: uniform, adaptive, paper", [](auto* s) { s->set_sampler("random"); });
    expect(bad, "unknown parameter 'mood'", [](auto* s) { s->set_sampler("paper:mood=bad"); });
    expect(bad, "known", [](auto* s) { s->set_filter("blur\nall"); });
    expect(bad, "must be relative",
           [](auto* s) { s->mutable_scene()->mutable_entries(0)->set_path("../x"); });
    expect(bad, "not among", [](auto* s) { s->mutable_scene()->set_main("other.gltf"); });
    expect(bad, "environment 'sky.hdr'",
           [](auto* s) { s->mutable_settings()->set_environment("sky.hdr"); });
    expect(bad, "is said to have 3 bytes",
           [](auto* s) { s->mutable_scene()->mutable_entries(0)->set_size(3); });
    expect(bad, "display name", [](auto* s) { s->set_display_name(std::string(300, 'x')); });
    expect(Code::FAILED_PRECONDITION, "upload it first", [](auto* s) {
        s->mutable_scene()->mutable_entries(0)->set_sha256(std::string(64, 'a'));
    });
    // A message over the limit is refused before it is read.
    expect(Code::RESOURCE_EXHAUSTED, "",
           [](auto* s) { s->set_display_name(std::string(std::size_t{5} << 20, 'x')); });
    v1::Job job;
    EXPECT_EQ(Create(Spec(), &job, std::string(200, 'x')).error_code(), bad);
    EXPECT_TRUE(Create(Spec(), &job).ok());
}

TEST_F(JobServiceTest, ErrorsCarryTheirDetail) {
    v1::Job job;
    const auto status = Get("jobs/none", &job);
    EXPECT_EQ(status.error_code(), Code::NOT_FOUND);
    // google.rpc.Status with one Any of relume.v1.ErrorDetail.
    EXPECT_THAT(status.error_details(), HasSubstr("type.googleapis.com/relume.v1.ErrorDetail"));
    v1::ErrorDetail detail;
    detail.set_reason("NOT_FOUND");
    detail.set_message(status.error_message());
    EXPECT_THAT(status.error_details(), HasSubstr(detail.SerializeAsString()));
}

TEST_F(JobServiceTest, UnknownJobsAreSaidByAllCalls) {
    v1::Job job;
    std::vector<v1::WatchJobResponse> events;
    std::string bytes;
    v1::FetchResultResponse last;
    for (const char* name : {"jobs/none", "", "../../etc", "jobs/"}) {
        EXPECT_EQ(Get(name, &job).error_code(), Code::NOT_FOUND);
        EXPECT_EQ(Cancel(name, &job).error_code(), Code::NOT_FOUND);
        EXPECT_EQ(Watch(name, 0, &events).error_code(), Code::NOT_FOUND);
        EXPECT_EQ(Fetch(name, 0, &bytes, &last).error_code(), Code::NOT_FOUND);
    }
}

TEST_F(JobServiceTest, CancelEndsTheJobItsWatchesAndItsLeases) {
    const v1::Job job = MustCreate(Spec());
    std::string bytes;
    v1::FetchResultResponse last;
    EXPECT_EQ(Fetch(job.name(), 0, &bytes, &last).error_code(), Code::FAILED_PRECONDITION);
    const auto worker = StartWorker({.hold = true});
    grpc::ClientContext context;
    v1::WatchJobRequest request;
    request.set_name(job.name());
    const auto reader = jobs->WatchJob(&context, request);
    v1::WatchJobResponse event;
    while (reader->Read(&event) && event.job().state() != v1::JOB_STATE_RENDERING) {
    }
    worker->WaitForLeases(1);
    v1::Job cancelled;
    ASSERT_TRUE(Cancel(job.name(), &cancelled).ok());
    EXPECT_EQ(cancelled.state(), v1::JOB_STATE_CANCELLED);
    while (reader->Read(&event)) {
    }
    EXPECT_TRUE(reader->Finish().ok());
    EXPECT_EQ(event.job().state(), v1::JOB_STATE_CANCELLED);
    ASSERT_TRUE(Cancel(job.name(), &cancelled).ok());  // stays as it is
    EXPECT_EQ(Fetch(job.name(), 0, &bytes, &last).error_code(), Code::FAILED_PRECONDITION);
    server.reset();  // sends the worker what waits for it, and Drain
    EXPECT_TRUE(worker->Join().ok());
    EXPECT_EQ(worker->revoked(), worker->leases());
    EXPECT_GT(worker->leases(), 0);
}

TEST_F(JobServiceTest, AWatcherThatGoesAwayChangesNothing) {
    const v1::Job job = MustCreate(Spec());
    {
        grpc::ClientContext context;
        v1::WatchJobRequest request;
        request.set_name(job.name());
        const auto reader = jobs->WatchJob(&context, request);
        v1::WatchJobResponse event;
        ASSERT_TRUE(reader->Read(&event));
        context.TryCancel();
        while (reader->Read(&event)) {
        }
        EXPECT_EQ(reader->Finish().error_code(), Code::CANCELLED);
    }
    const auto worker = StartWorker();
    EXPECT_EQ(WaitForEnd(job.name()).state(), v1::JOB_STATE_SUCCEEDED);
}

TEST_F(JobServiceTest, ListsNewestFirstInPages) {
    std::vector<std::string> names;
    for (int i = 0; i < 5; ++i) {
        names.insert(names.begin(), MustCreate(Spec()).name());
    }
    std::vector<std::string> listed;
    v1::ListJobsResponse page;
    std::string token;
    int pages = 0;
    do {
        page.Clear();
        ASSERT_TRUE(List(2, token, &page).ok());
        EXPECT_LE(page.jobs_size(), 2);
        for (const auto& job : page.jobs()) {
            listed.push_back(job.name());
            EXPECT_EQ(job.spec().scene().entries_size(), 0);
        }
        token = page.next_page_token();
        ++pages;
    } while (!token.empty());
    EXPECT_EQ(listed, names);
    EXPECT_EQ(pages, 3);
    EXPECT_EQ(List(-1, "", &page).error_code(), Code::INVALID_ARGUMENT);
    EXPECT_EQ(List(2, "junk", &page).error_code(), Code::INVALID_ARGUMENT);
}

TEST_F(JobServiceTest, SeveralJobsShareTheWorkers) {
    const auto one = StartWorker(), two = StartWorker();
    std::vector<v1::Job> made;
    for (int i = 0; i < 4; ++i) {
        made.push_back(MustCreate(Spec(i % 2 == 0 ? "uniform" : "paper")));
    }
    std::vector<std::string> digests;
    for (const auto& job : made) {
        digests.push_back(WaitForEnd(job.name()).image_sha256());
    }
    EXPECT_EQ(digests[0], digests[2]);
    EXPECT_EQ(digests[1], digests[3]);
    EXPECT_NE(digests[0], digests[1]);
}

}  // namespace
}  // namespace relume::server
