#include <gmock/gmock.h>

#include <chrono>

#include "tests/integration/rpc/farm_fixture.h"
#include "tests/support/scrape.h"

namespace relume::server {
namespace {

class MetricsTest : public FarmFixture {
  protected:
    MetricsTest() {
        ServerOptions options;
        options.metrics = ListenAddress{"127.0.0.1", 0};
        Restart(options);
    }
    Exposition Page() { return Scrape(server->metrics_address()->port); }
};

TEST_F(MetricsTest, NoneByDefault) {
    Restart();
    EXPECT_FALSE(server->metrics_address());
}

TEST_F(MetricsTest, AddUpToTheReportsOfAllJobs) {
    std::vector<v1::Job> reports;
    const v1::JobSpec spec = Spec();
    const v1::Job first = MustCreate(spec);
    {
        // Loses leases in hand.
        const auto dying = StartWorker({.name = "dying", .die_after = 2});
        dying->Join();
        const auto worker = StartWorker({.name = "box", .wrong_until = 1});
        reports.push_back(WaitForEnd(first.name()));
        reports.push_back(WaitForEnd(MustCreate(Spec("adaptive")).name()));
        ASSERT_EQ(reports[1].state(), v1::JOB_STATE_SUCCEEDED);

        const Exposition page = Page();
        EXPECT_EQ(page.At("relume_workers{state=\"responding\"}"), 1);
        EXPECT_EQ(page.At("relume_worker_threads"), 1);
        EXPECT_GT(page.At("relume_worker_samples_total{worker=\"box\"}"), 0);
        EXPECT_GT(page.At("relume_worker_samples_per_second{worker=\"box\"}"), 0);
        EXPECT_FALSE(page.Has("relume_worker_samples_total{worker=\"dying\"}"));
    }
    const std::size_t fetched = Fetch(first.name()).size();
    const v1::Job cancelled = MustCreate(spec);
    v1::Job job;
    ASSERT_TRUE(Cancel(cancelled.name(), &job).ok());

    double samples = 0, rays = 0, bad = 0, issued = 0, reissued = 0, duplicate = 0;
    double busy = 0, plan = 0, merge = 0, filter = 0;
    for (const v1::Job& report : reports) {
        samples += static_cast<double>(report.samples_done());
        rays += static_cast<double>(report.rays());
        bad += static_cast<double>(report.bad_samples());
        issued += static_cast<double>(report.leases_issued());
        reissued += static_cast<double>(report.leases_reissued());
        duplicate += static_cast<double>(report.results_duplicate());
        plan += report.plan_seconds();
        merge += report.merge_seconds();
        filter += report.filter().seconds();
        for (const auto& share : report.workers()) {
            busy += share.busy_seconds();
        }
    }
    const Exposition page = Page();
    EXPECT_EQ(samples, 2 * 48 * 40 * 8);
    EXPECT_EQ(page.At("relume_samples_total"), samples);
    EXPECT_EQ(page.At("relume_rays_total"), rays);
    EXPECT_EQ(page.At("relume_bad_samples_total"), bad);
    EXPECT_EQ(page.At("relume_leases_issued_total"), issued);
    EXPECT_EQ(page.At("relume_leases_reissued_total"), reissued);
    EXPECT_GT(reissued, 0);
    EXPECT_EQ(page.At("relume_results_duplicate_total"), duplicate);
    EXPECT_EQ(page.At("relume_results_wrong_total"), 1);
    EXPECT_NEAR(page.At("relume_render_core_seconds_total"), busy, 1e-9);
    EXPECT_NEAR(page.At("relume_plan_seconds_total"), plan, 1e-9);
    // The last result is counted once it is merged, and the report is made by that.
    EXPECT_NEAR(page.At("relume_merge_seconds_total"), merge, 0.05);
    EXPECT_NEAR(page.At("relume_filter_seconds_sum"), filter, 1e-9);
    EXPECT_EQ(page.At("relume_filter_seconds_count"), 2);
    EXPECT_EQ(page.At("relume_job_wait_seconds_count"), 2);
    EXPECT_EQ(page.At("relume_jobs_finished_total{state=\"succeeded\"}"), 2);
    EXPECT_EQ(page.At("relume_jobs_finished_total{state=\"cancelled\"}"), 1);
    EXPECT_EQ(page.At("relume_jobs_finished_total{state=\"failed\"}"), 0);
    EXPECT_EQ(page.At("relume_remaining_core_seconds"), 0);
    EXPECT_EQ(page.At("relume_active_pixels"), 0);
    EXPECT_EQ(page.types.at("relume_samples_total"), "counter");
    EXPECT_EQ(page.types.at("relume_active_pixels"), "gauge");
    EXPECT_EQ(page.types.at("relume_filter_seconds"), "summary");

    const double scene = static_cast<double>(spec.scene().entries(0).size());
    EXPECT_EQ(page.At("relume_received_bytes_total{kind=\"blob\"}"), scene);
    EXPECT_EQ(page.At("relume_blob_store_bytes"), scene);
    EXPECT_EQ(page.At("relume_blob_store_quota_bytes"), 16 << 20);
    EXPECT_EQ(page.At("relume_sent_bytes_total{kind=\"result\"}"), fetched);
    EXPECT_EQ(fetched, reports[0].result_size());
    EXPECT_GT(page.At("relume_received_bytes_total{kind=\"work\"}"), 1000);
    EXPECT_GT(page.At("relume_sent_bytes_total{kind=\"work\"}"), 1000);
}

TEST_F(MetricsTest, AJobHasSeriesWhileItIsUnderWay) {
    v1::JobSpec spec = Spec();
    spec.set_display_name("my \"job\"");
    const v1::Job job = MustCreate(spec);
    EXPECT_EQ(Page().At("relume_jobs{state=\"queued\"}"), 1);
    const auto worker = StartWorker({.hold = true});
    worker->WaitForLeases(3);
    Exposition page = Page();
    const std::string label = "{job_name=\"" + job.name() + "\"}";
    EXPECT_EQ(page.At("relume_jobs{state=\"rendering\"}"), 1);
    EXPECT_EQ(page.At("relume_job_samples_total" + label), 0);
    EXPECT_EQ(page.At("relume_job_active_pixels" + label), 48 * 40);
    EXPECT_EQ(page.At("relume_job_info{job_name=\"" + job.name() +
                      "\",title=\"my "
                      "\\\"job\\\"\",owner=\"127.0.0.1\",priority=\"0\",state=\"rendering\","
                      "sampler=\"uniform\","
                      "filter=\"none\"}"),
              1);
    EXPECT_EQ(page.At("relume_leases{state=\"lent\"}"), 3);
    EXPECT_GT(page.At("relume_units_waiting"), 0);
    EXPECT_EQ(page.At("relume_jobs_unpredicted"), 1);
    v1::Job over;
    ASSERT_TRUE(Cancel(job.name(), &over).ok());
    page = Page();
    EXPECT_FALSE(page.Has("relume_job_samples_total" + label));
    EXPECT_EQ(page.At("relume_leases{state=\"lent\"}"), 0);
    EXPECT_EQ(page.At("relume_units_waiting"), 0);
}

// How long a page takes is told, not asserted: milliseconds in the test's properties.
TEST_F(MetricsTest, AThousandFinishedJobsAreCounted) {
    const v1::JobSpec spec = Spec();
    for (int i = 0; i < 1000; ++i) {
        v1::Job job;
        ASSERT_TRUE(Cancel(MustCreate(spec).name(), &job).ok());
    }
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < 10; ++i) {
        ASSERT_EQ(Page().At("relume_jobs_finished_total{state=\"cancelled\"}"), 1000);
    }
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    RecordProperty("milliseconds", std::to_string(seconds / 10 * 1000));
}

}  // namespace
}  // namespace relume::server
