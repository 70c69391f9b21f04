#include "server/metrics/families.h"

#include <gmock/gmock.h>
#include <prometheus/check_names.h>
#include <prometheus/text_serializer.h>

#include <set>
#include <sstream>

#include "tests/support/scrape.h"

namespace relume::metrics {
namespace {

using prometheus::MetricType;
using testing::EndsWith;
using testing::Not;
using testing::StartsWith;

FarmStatus SomeStatus() {
    FarmStatus status;
    status.queue.rendering = 1;
    status.queue.filtering = 1;
    status.queue.under_way_left_out = 1;
    status.queue.workers_responding = 2;
    jobs::JobStatus job;
    job.name = "jobs/a";
    job.samples = 123456789;
    job.relmse = 0.25;
    job.core_seconds_left = 7.5;
    status.queue.under_way = {job};
    status.job_texts = {{"say \"hi\"\n\\", "adaptive:pilot=4", "auto:effort=0.6", "ann@box", -3}};
    jobs::WorkerInfo worker;
    worker.name = "box:1";
    worker.samples_done = 42;
    status.queue.workers = {worker};
    status.tasks_waiting = {{"control", 3}};
    status.blob_bytes = std::uint64_t{1} << 50;
    return status;
}

Exposition Page(const std::optional<FarmStatus>& status) {
    std::ostringstream text;
    prometheus::TextSerializer().Serialize(text, MakeFamilies(status));
    return ParseExposition(text.str());
}

TEST(Families, HaveNamesAndTypesByTheRules) {
    std::set<std::string> seen;
    for (const auto& family : MakeFamilies(SomeStatus())) {
        EXPECT_TRUE(seen.insert(family.name).second) << family.name << " twice";
        EXPECT_TRUE(prometheus::CheckMetricName(family.name)) << family.name;
        EXPECT_THAT(family.name, StartsWith("relume_"));
        EXPECT_THAT(family.help, EndsWith(".")) << family.name;
        if (family.type == MetricType::Counter) {
            EXPECT_THAT(family.name, EndsWith("_total"));
        } else {
            EXPECT_THAT(family.name, Not(EndsWith("_total")));
        }
        for (const char* unit : {"_ms", "_milliseconds", "_kb", "_mb", "_percent", "_minutes"}) {
            EXPECT_THAT(family.name, Not(EndsWith(unit)));
        }
        for (const auto& metric : family.metric) {
            for (const auto& label : metric.label) {
                EXPECT_NE(label.name, "job") << "Prometheus has that itself";
                EXPECT_NE(label.name, "instance") << "Prometheus has that itself";
            }
        }
    }
    EXPECT_GT(seen.size(), 35u);
}

TEST(Families, TellOfEachJobAndWorkerWhatIsKnown) {
    const Exposition page = Page(SomeStatus());
    EXPECT_EQ(page.At("relume_job_samples_total{job_name=\"jobs/a\"}"), 123456789);
    EXPECT_EQ(page.At("relume_job_relmse{job_name=\"jobs/a\",image=\"unfiltered\"}"), 0.25);
    EXPECT_FALSE(page.Has("relume_job_relmse{job_name=\"jobs/a\",image=\"returned\"}"));
    EXPECT_EQ(page.At("relume_job_remaining_core_seconds{job_name=\"jobs/a\"}"), 7.5);
    EXPECT_FALSE(page.Has("relume_job_eta_seconds{job_name=\"jobs/a\"}"));
    EXPECT_EQ(page.types.at("relume_job_eta_seconds"), "gauge") << "named without series, too";
    EXPECT_EQ(page.At("relume_job_info{job_name=\"jobs/a\",title=\"say \\\"hi\\\"\\n\\\\\","
                      "owner=\"ann@box\",priority=\"-3\",state=\"rendering\","
                      "sampler=\"adaptive\",filter=\"auto\"}"),
              1);
    EXPECT_EQ(page.At("relume_worker_samples_total{worker=\"box:1\"}"), 42);
    EXPECT_EQ(page.At("relume_series_left_out{of=\"jobs\"}"), 1);
    EXPECT_EQ(page.At("relume_series_left_out{of=\"workers\"}"), 1);
    EXPECT_EQ(page.At("relume_server_tasks_waiting{thread=\"control\"}"), 3);
    EXPECT_EQ(page.At("relume_blob_store_bytes"), 1125899906842624.0) << "all digits are there";
    EXPECT_EQ(page.At("relume_build_info{version=\"0.1.0\",protocol=\"3\"}"), 1);
}

TEST(Families, WithoutAStatusSayThatTheCoordinatorIsStuck) {
    const Exposition page = Page(std::nullopt);
    EXPECT_EQ(page.types.size(), 2u);
    EXPECT_EQ(page.At("relume_coordinator_responding"), 0);
    EXPECT_TRUE(page.Has("relume_build_info{version=\"0.1.0\",protocol=\"3\"}"));
}

}  // namespace
}  // namespace relume::metrics
