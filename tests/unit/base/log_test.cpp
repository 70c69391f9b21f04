#include "core/base/log.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <thread>
#include <vector>

#include "core/base/error.h"

namespace relume {
namespace {

using testing::HasSubstr;

// Lines that were logged meanwhile, each parsed.
class LogTest : public testing::Test {
  protected:
    void Start(LogFormat format, const std::string& level = "info") {
        testing::internal::CaptureStderr();
        InitLogging("test", level, format);
    }
    std::string Text() {
        spdlog::default_logger()->flush();
        return testing::internal::GetCapturedStderr();
    }
    std::vector<nlohmann::json> Lines() {
        std::vector<nlohmann::json> lines;
        std::istringstream text(Text());
        for (std::string line; std::getline(text, line);) {
            lines.push_back(nlohmann::json::parse(line));
        }
        return lines;
    }
    ~LogTest() override {
        SetLogWorker("");
        InitLogging("test", "info", LogFormat::kText);
    }
};

TEST_F(LogTest, JsonLinesTellWhatTheyAreAbout) {
    Start(LogFormat::kJson);
    spdlog::info("nothing known");
    {
        const LogScope job({.job = "jobs/a"});
        spdlog::warn("of a job");
        {
            const LogScope lease({.worker = "box", .lease = 7});
            spdlog::error("of a lease");
        }
        spdlog::info("of the job again");
    }
    const auto lines = Lines();
    ASSERT_EQ(lines.size(), 4u);
    EXPECT_EQ(lines[0]["msg"], "nothing known");
    EXPECT_EQ(lines[0]["logger"], "test");
    EXPECT_EQ(lines[0]["level"], "info");
    EXPECT_TRUE(lines[0]["pid"].is_number_integer());
    EXPECT_TRUE(std::regex_match(lines[0]["ts"].get<std::string>(),
                                 std::regex(R"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z)")));
    EXPECT_EQ(lines[0].size(), 5u) << lines[0];
    EXPECT_EQ(lines[1]["job"], "jobs/a");
    EXPECT_FALSE(lines[1].contains("worker"));
    EXPECT_EQ(lines[2]["job"], "jobs/a");
    EXPECT_EQ(lines[2]["worker"], "box");
    EXPECT_EQ(lines[2]["lease"], 7);
    EXPECT_EQ(lines[2]["level"], "error");
    EXPECT_EQ(lines[3]["job"], "jobs/a");
    EXPECT_FALSE(lines[3].contains("lease"));
}

TEST_F(LogTest, JsonLinesAreValidWhateverIsSaid) {
    Start(LogFormat::kJson);
    const std::string quoted = "say \"no\" \\ to\nlines\tand \x01 control";
    const LogScope scope({.job = "jobs/\"\n", .worker = "w\\\xc3"});
    spdlog::info("{}", quoted);
    spdlog::info("{}", "no UTF-8: \xff\xc3(");
    spdlog::info("{}", "Grüße, 猫");
    spdlog::info("{}", std::string("a zero: \0!", 10));
    LogFatal("test", "the \"end\"", LogFormat::kJson);
    const auto lines = Lines();
    ASSERT_EQ(lines.size(), 5u);
    EXPECT_EQ(lines[0]["msg"], quoted);
    EXPECT_EQ(lines[0]["job"], "jobs/\"\n");
    EXPECT_EQ(lines[0]["worker"], "w\\\xef\xbf\xbd");
    EXPECT_EQ(lines[1]["msg"], "no UTF-8: \xef\xbf\xbd\xef\xbf\xbd(");
    EXPECT_EQ(lines[2]["msg"], "Grüße, 猫");
    EXPECT_EQ(lines[3]["msg"], std::string("a zero: \0!", 10));
    EXPECT_EQ(lines[4]["msg"], "the \"end\"");
    EXPECT_EQ(lines[4]["level"], "critical");
}

TEST_F(LogTest, ScopesAreTheirThreadsOwnAndTheProcessHasAWorker) {
    Start(LogFormat::kJson);
    SetLogWorker("box");
    const LogScope scope({.job = "jobs/a"});
    std::thread([] { spdlog::info("elsewhere"); }).join();
    {
        const LogScope other({.worker = "other"});
        spdlog::info("here");
    }
    const auto lines = Lines();
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_FALSE(lines[0].contains("job"));
    EXPECT_EQ(lines[0]["worker"], "box");
    EXPECT_EQ(lines[1]["job"], "jobs/a");
    EXPECT_EQ(lines[1]["worker"], "other");
}

TEST_F(LogTest, TextHasNoIdsAndLevelsHold) {
    Start(LogFormat::kText, "warn");
    const LogScope scope({.job = "jobs/a"});
    spdlog::info("quiet");
    spdlog::warn("loud");
    LogFatal("test", "the end", LogFormat::kText);
    const std::string text = Text();
    EXPECT_THAT(text, HasSubstr("test warning loud\n"));
    EXPECT_THAT(text, HasSubstr("\ntest: the end\n"));
    EXPECT_THAT(text, testing::Not(HasSubstr("quiet")));
    EXPECT_THAT(text, testing::Not(HasSubstr("jobs/a")));
}

TEST(LogOptions, UnknownOnesAreRefusedWithTheKnown) {
    EXPECT_EQ(ParseLogFormat("json"), LogFormat::kJson);
    EXPECT_EQ(ParseLogFormat("text"), LogFormat::kText);
    EXPECT_THROW(ParseLogFormat("JSON"), Error);
    EXPECT_THROW(InitLogging("test", "loud", LogFormat::kText), Error);
}

}  // namespace
}  // namespace relume
