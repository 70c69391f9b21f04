#include "client/cli/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "client/cli/progress_meter.h"

namespace relume::client {
namespace {

v1::Job Rendering(double seconds, std::uint64_t samples, std::uint64_t budget = 10'000) {
    v1::Job job;
    job.set_state(v1::JOB_STATE_RENDERING);
    job.set_render_seconds(seconds);
    job.set_samples_done(samples);
    job.set_samples_budget(budget);
    return job;
}

TEST(FormatDuration, HasTheUnitsThatMatter) {
    EXPECT_EQ(FormatDuration(0), "0 s");
    EXPECT_EQ(FormatDuration(0.2), "1 s");
    EXPECT_EQ(FormatDuration(59), "59 s");
    EXPECT_EQ(FormatDuration(59.5), "1 min 00 s");
    EXPECT_EQ(FormatDuration(185), "3 min 05 s");
    EXPECT_EQ(FormatDuration(7800), "2 h 10 min");
}

TEST(FormatCount, HasThreeDigits) {
    EXPECT_EQ(FormatCount(0), "0");
    EXPECT_EQ(FormatCount(999), "999");
    EXPECT_EQ(FormatCount(999.6), "1.00 k");
    EXPECT_EQ(FormatCount(12'345), "12.3 k");
    EXPECT_EQ(FormatCount(999'700), "1.00 M");
    EXPECT_EQ(FormatCount(4.56e9), "4.56 G");
}

TEST(RateEstimate, NeedsTwoPointsThatAreApart) {
    RateEstimate rate;
    EXPECT_FALSE(rate.PerSecond());
    rate.Add(1, 100);
    EXPECT_FALSE(rate.PerSecond());
    rate.Add(1.1, 200);
    EXPECT_FALSE(rate.PerSecond());
    rate.Add(2, 600);
    EXPECT_DOUBLE_EQ(*rate.PerSecond(), 500);
}

TEST(RateEstimate, ForgetsWhatIsLongAgo) {
    RateEstimate rate;
    std::uint64_t samples = 0;
    for (int second = 0; second < 100; ++second) {
        samples += second < 50 ? 1000 : 10;  // a worker left
        rate.Add(second, samples);
    }
    EXPECT_DOUBLE_EQ(*rate.PerSecond(), 10);
}

TEST(RateEstimate, PassesOverEventsThatComeTwice) {
    RateEstimate rate;
    rate.Add(1, 100);
    rate.Add(2, 200);
    rate.Add(1, 100);
    rate.Add(2, 200);
    EXPECT_DOUBLE_EQ(*rate.PerSecond(), 100);
}

void SetEta(double seconds, double low, double high, v1::Job* job) {
    job->set_eta_seconds(seconds);
    job->set_eta_low_seconds(low);
    job->set_eta_high_seconds(high);
}

TEST(FormatEta, HasAnIntervalThatSaysSomething) {
    v1::Job job;
    EXPECT_EQ(FormatEta(job), "");
    SetEta(12, 10, 15, &job);
    EXPECT_EQ(FormatEta(job), "12 s left (10-15)");
    SetEta(12, 11.5, 12, &job);
    EXPECT_EQ(FormatEta(job), "12 s left");
    SetEta(185, 59, 300, &job);
    EXPECT_EQ(FormatEta(job), "3 min 05 s left (59 s - 5 min 00 s)");
    SetEta(55, 50, 70, &job);
    EXPECT_EQ(FormatEta(job), "55 s left (50 s - 1 min 10 s)");
}

TEST(ShareDone, IsOfTheTimeIfThatIsKnownElseOfTheBudget) {
    v1::Job job = Rendering(1, 4000);
    EXPECT_DOUBLE_EQ(*ShareDone(job), 0.4);
    job.set_elapsed_seconds(6);
    SetEta(2, 1, 3, &job);
    EXPECT_DOUBLE_EQ(*ShareDone(job), 0.75);
    EXPECT_FALSE(ShareDone(Rendering(1, 4000, 0)));
}

TEST(FormatProgress, SaysAllThatIsKnown) {
    v1::Job job = Rendering(1, 4567);
    EXPECT_EQ(FormatProgress(job, std::nullopt), "rendering: 45 %");
    job.add_passes();
    job.set_relmse(0.01234);
    job.set_elapsed_seconds(5);
    SetEta(5, 4, 7, &job);
    EXPECT_EQ(FormatProgress(job, 1000.0),
              "rendering: 50 %, pass 1, 1.00 k samples/s, estimated RelMSE 0.0123, 5 s left (4-7)");
    job.mutable_spec()->set_target(0.001);
    job.set_image_relmse(0.005);  // of the filtered image
    EXPECT_EQ(FormatProgress(job, std::nullopt),
              "rendering: 50 %, pass 1, estimated RelMSE 0.005, 5 s left (4-7)");
    EXPECT_EQ(FormatProgress(Rendering(0, 0, 0), std::nullopt), "rendering");
    job.set_state(v1::JOB_STATE_QUEUED);
    EXPECT_EQ(FormatProgress(job, 1000.0), "queued");
    job.set_message("waits for memory");
    EXPECT_EQ(FormatProgress(job, 1000.0), "queued, waits for memory");
    job.clear_message();
}

TEST(FormatBar, FillsWithTheShareAndFitsTheTerminal) {
    EXPECT_EQ(FormatBar(Rendering(1, 0), std::nullopt, 80), "[>                       ] 0 %");
    EXPECT_EQ(FormatBar(Rendering(1, 5000), std::nullopt, 80), "[============>           ] 50 %");
    EXPECT_EQ(FormatBar(Rendering(1, 10'000), std::nullopt, 80),
              "[========================] 100 %");
    EXPECT_EQ(FormatBar(Rendering(1, 5000, 0), std::nullopt, 80), "[>                       ] ");
    EXPECT_EQ(FormatBar(Rendering(1, 5000), 100.0, 20).size(), 20u);
    EXPECT_EQ(FormatBar(Rendering(1, 5000), 100.0, -3), "");
    v1::Job queued;
    queued.set_state(v1::JOB_STATE_QUEUED);
    queued.set_message("waits for memory");
    EXPECT_THAT(FormatBar(queued, std::nullopt, 80),
                testing::HasSubstr("] queued, waits for memory"));
}

// What a meter of a style writes to a file, with a clock that the test turns.
class ProgressMeterTest : public testing::Test {
  protected:
    ~ProgressMeterTest() override {
        std::fclose(out_);
        std::free(text_);
    }
    std::string Written() {
        std::fflush(out_);
        return {text_, size_};
    }

    double now_ = 0;
    char* text_ = nullptr;
    std::size_t size_ = 0;
    std::FILE* out_ = open_memstream(&text_, &size_);
};

TEST_F(ProgressMeterTest, WritesLinesEveryFewSecondsAndAtEachChange) {
    ProgressMeter meter(ProgressStyle::kLines, out_, [this] { return now_; });
    v1::Job job = Rendering(0, 0);
    job.set_state(v1::JOB_STATE_QUEUED);
    meter.Update(job);
    for (int i = 0; i <= 60; ++i) {
        now_ = 0.1 * i;
        meter.Update(Rendering(now_, static_cast<std::uint64_t>(100 * i)));
    }
    EXPECT_EQ(Written(),
              "queued\nrendering: 0 %\nrendering: 30 %, 1.00 k samples/s\n"
              "rendering: 60 %, 1.00 k samples/s\n");
}

TEST_F(ProgressMeterTest, RedrawsTheBarAtMostTenTimesASecond) {
    {
        ProgressMeter meter(ProgressStyle::kBar, out_, [this] { return now_; });
        for (int i = 0; i < 1000; ++i) {
            now_ = 0.001 * i;
            meter.Update(Rendering(now_, static_cast<std::uint64_t>(i)));
        }
    }
    const std::string text = Written();
    EXPECT_EQ(std::count(text.begin(), text.end(), '['), 2 * 10 + 1);  // an escape and a bar each
    EXPECT_EQ(text.substr(text.size() - 4), "\r\x1b[K");               // taken away in the end
    EXPECT_EQ(text.find('\n'), std::string::npos);
}

TEST_F(ProgressMeterTest, QuietLetsWarningsPassAlone) {
    ProgressMeter meter(ProgressStyle::kNone, out_, [this] { return now_; });
    meter.Update(Rendering(0, 0));
    meter.Upload(1, 2);
    meter.Note("a note");
    meter.Warn("a warning");
    EXPECT_EQ(Written(), "a warning\n");
}

}  // namespace
}  // namespace relume::client
