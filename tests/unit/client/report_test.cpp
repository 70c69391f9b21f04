#include "client/lib/report.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "client/cli/job_result.h"

namespace relume::client {
namespace {

v1::Job MakeJob() {
    v1::Job job;
    job.set_name("jobs/7f3a");
    job.set_state(v1::JOB_STATE_SUCCEEDED);
    job.set_message("sample budget spent");
    job.set_stop_reason(v1::STOP_REASON_SPP);
    auto* settings = job.mutable_spec()->mutable_settings();
    settings->set_width(100);
    settings->set_height(50);
    job.mutable_spec()->set_spp(8);
    job.set_samples_done(40'000);
    job.set_rays(120'000);
    job.set_render_seconds(2);
    job.set_plan_seconds(0.25);
    job.set_plan_filter_seconds(0.125);
    job.set_merge_seconds(0.0625);
    job.set_relmse(0.25);
    auto* pass = job.add_passes();
    pass->set_samples(20'000);
    pass->set_active_pixels(5000);
    pass->set_relmse_predicted(0.5);
    job.set_predicted_seconds(9);
    job.set_elapsed_seconds(10);
    job.add_forecast()->set_samples(80'000);
    pass->set_plan_seconds(0.125);
    for (const auto& [name, samples] : {std::pair{"a", 30'000}, std::pair{"b", 10'000}}) {
        auto* worker = job.add_workers();
        worker->set_worker(name);
        worker->set_samples(static_cast<std::uint64_t>(samples));
    }
    job.mutable_filter()->set_filter("bilateral:mode=corrected");
    job.mutable_filter()->set_seconds(0.5);
    job.add_notes("both say this");
    job.add_notes("the server says this");
    job.set_image_sha256("abc");
    job.set_result_size(1234);
    return job;
}

ReportFacts MakeFacts() {
    ReportFacts facts;
    facts.scene.main = "room.gltf";
    facts.scene.entries = {{"room.gltf", 100, "x"}, {"room.bin", 50, "y"}};
    facts.output = "out.exr";
    facts.notes = {"both say this", "the client says this"};
    facts.job = 3;
    return facts;
}

TEST(MeanSpp, CountsThePixelsOfTheWindow) {
    v1::Job job = MakeJob();
    EXPECT_DOUBLE_EQ(MeanSpp(job), 8);
    auto* crop = job.mutable_spec()->mutable_settings()->mutable_crop();
    crop->set_x0(10);
    crop->set_x1(60);
    crop->set_y1(20);
    EXPECT_DOUBLE_EQ(MeanSpp(job), 40);
    EXPECT_DOUBLE_EQ(MeanSpp(v1::Job()), 0);
}

TEST(Report, TellsWhatTheJobTells) {
    const auto report = MakeReport(MakeJob(), MakeFacts());
    EXPECT_EQ(report["job"], "jobs/7f3a");
    EXPECT_EQ(report["state"], "succeeded");
    EXPECT_EQ(report["scene"]["bytes"], 150);
    EXPECT_EQ(report["scene"]["files"], 2);
    EXPECT_EQ(report["spp"], 8);
    EXPECT_EQ(report["samples_per_second"], 20'000);
    EXPECT_EQ(report["rays_per_second"], 60'000);
    EXPECT_EQ(report["workers"][0]["share"], 0.75);
    EXPECT_EQ(report["passes"][0]["active_pixels"], 5000);
    EXPECT_EQ(report["passes"][0]["relmse_predicted"], 0.5);
    EXPECT_EQ(report["stop_reason"], "spp");
    EXPECT_EQ(report["forecast"]["seconds"], 9);
    EXPECT_EQ(report["forecast"]["seconds_real"], 10);
    EXPECT_EQ(report["forecast"]["curve"][0]["samples"], 80'000);
    EXPECT_EQ(report["image"]["sha256"], "abc");
    EXPECT_EQ(report["passes"][0]["plan_seconds"], 0.125);
    EXPECT_EQ(report["seconds"]["planning"], 0.25);
    EXPECT_EQ(report["seconds"]["planning_filter"], 0.125);
    EXPECT_EQ(report["seconds"]["merging"], 0.0625);
    EXPECT_EQ(report["seconds"]["wait"], 0.5);  // 3 - 2 - 0.5
}

TEST(Report, HasNullForWhatDoesNotApply) {
    v1::Job job = MakeJob();
    auto report = MakeReport(job, MakeFacts());
    EXPECT_TRUE(report["settings"]["crop"].is_null());
    EXPECT_TRUE(report["settings"]["lens_radius"].is_null());
    EXPECT_TRUE(report["filter"]["mse"].is_null());
    EXPECT_TRUE(report["settings"]["target"].is_null());
    EXPECT_TRUE(report["settings"]["time_limit"].is_null());
    EXPECT_TRUE(report["image_relmse"].is_null());
    EXPECT_TRUE(report["passes"][0]["image_relmse"].is_null());
    job.mutable_spec()->mutable_settings()->set_lens_radius(0);
    job.mutable_filter()->set_mse(-0.5);
    report = MakeReport(job, MakeFacts());
    EXPECT_EQ(report["settings"]["lens_radius"], 0);
    EXPECT_EQ(report["filter"]["mse"], -0.5);
}

TEST(Report, TellsTheTimeLimitOfTheWholeCommand) {
    v1::Job job = MakeJob();
    ReportFacts facts = MakeFacts();
    job.mutable_spec()->set_time_limit(18.5);  // what was left when the job was made
    EXPECT_EQ(MakeReport(job, facts)["settings"]["time_limit"], 18.5);
    facts.time_limit = 20;
    EXPECT_EQ(MakeReport(job, facts)["settings"]["time_limit"], 20);
}

TEST(Report, HasEachNoteOnce) {
    EXPECT_EQ(
        MakeReport(MakeJob(), MakeFacts())["notes"],
        (nlohmann::ordered_json{"both say this", "the client says this", "the server says this"}));
}

TEST(Report, EveryFieldIsInTheDocument) {
    std::ifstream in(std::string(RELUME_SOURCE_DIR) + "/docs/report.md");
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    ASSERT_FALSE(text.empty());
    const auto report = MakeReport(MakeJob(), MakeFacts());
    for (const auto& [key, value] : report.items()) {
        EXPECT_NE(text.find(key), std::string::npos) << key;
        const auto& fields = value.is_array() && !value.empty() ? value[0] : value;
        if (!fields.is_object()) {
            continue;
        }
        for (const auto& [field, ignored] : fields.items()) {
            const bool found = text.find("`" + field + "`") != std::string::npos ||
                               text.find(key + "." + field + "`") != std::string::npos ||
                               text.find(key + "[]." + field + "`") != std::string::npos;
            EXPECT_TRUE(found) << key << "." << field;
        }
    }
}

TEST(JobResult, SuccessAloneIsEnough) {
    v1::Job job = MakeJob();
    EXPECT_NO_THROW(RequireSuccess(job));
    for (const auto state : {v1::JOB_STATE_QUEUED, v1::JOB_STATE_RENDERING, v1::JOB_STATE_FAILED,
                             v1::JOB_STATE_CANCELLED}) {
        job.set_state(state);
        EXPECT_THROW(RequireSuccess(job), Error);
    }
}

TEST(JobResult, JsonHasTheJobsName) {
    EXPECT_EQ(JobJson(MakeJob())["job"], "jobs/7f3a");
    EXPECT_EQ(JobJson(MakeJob())["ended"], "");
    google::protobuf::Timestamp time;
    time.set_seconds(1'767'225'600);
    EXPECT_EQ(FormatTime(time), "2026-01-01T00:00:00Z");
}

}  // namespace
}  // namespace relume::client
