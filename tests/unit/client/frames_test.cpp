#include "client/lib/frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace relume::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string ProblemOf(const std::function<void()>& call) {
    try {
        call();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
        return error.what();
    }
    ADD_FAILURE() << "nothing was thrown";
    return "";
}

std::string ProblemOfFrames(const std::string& text) {
    return ProblemOf([&] { ParseFrames(text); });
}

std::string ProblemOfPattern(const std::string& text) {
    return ProblemOf([&] { FramePattern("-o", text); });
}

TEST(Frames, RangesStepsAndLists) {
    EXPECT_THAT(ParseFrames("7"), ElementsAre(7));
    EXPECT_THAT(ParseFrames("0-3"), ElementsAre(0, 1, 2, 3));
    EXPECT_THAT(ParseFrames("1..3"), ElementsAre(1, 2, 3));
    EXPECT_THAT(ParseFrames("1-8x3"), ElementsAre(1, 4, 7));
    EXPECT_THAT(ParseFrames("1,5,9"), ElementsAre(1, 5, 9));
    EXPECT_THAT(ParseFrames("8-9, 1-2 5"), ElementsAre(8, 9, 1, 2, 5));
    EXPECT_THAT(ParseFrames("5-1x2"), ElementsAre(5, 3, 1));
    EXPECT_THAT(ParseFrames("3-3x9"), ElementsAre(3));
    EXPECT_THAT(ParseFrames("007"), ElementsAre(7));
    EXPECT_EQ(ParseFrames("1-100000").size(), kMaxFrames);
}

TEST(Frames, AFrameNamedTwiceCountsOnceWhereItIsNamedFirst) {
    EXPECT_THAT(ParseFrames("1-5x4,1-5"), ElementsAre(1, 5, 2, 3, 4));
}

TEST(Frames, FaultsSayWhatAndShowARange) {
    for (const auto& [text, problem] : std::vector<std::pair<std::string, std::string>>{
             {"", "no frame is named"},
             {" , ", "no frame is named"},
             {"a", "'a' is no frame"},
             {"1-", "a frame is missing"},
             {"-3", "before the animation's start"},
             {"1--3", "before the animation's start"},
             {"1-5x", "a step is missing"},
             {"1-5x0", "at least 1"},
             {"1-5y2", "'y2' is not understood"},
             {"3x2", "'x2' is not understood"},
             {"1.5", "'.5' is not understood"},
             {"99999999999", "above 9999999"},
             {"10000000", "above 9999999"},
             {"1-100001", "more than 100000 frames"}}) {
        EXPECT_THAT(ProblemOfFrames(text), HasSubstr(problem)) << text;
        EXPECT_THAT(ProblemOfFrames(text), HasSubstr("e.g. 1-48")) << text;
    }
}

TEST(Frames, AreNamedBriefly) {
    for (const char* text : {"7", "1,2", "1-3", "1-7x3", "1-3,9,20-40x10", "3,1"}) {
        EXPECT_EQ(FormatFrames(ParseFrames(text)), text);
    }
    EXPECT_EQ(FormatFrames({}), "");
    EXPECT_EQ(FormatFrames({3, 2, 1}), "3,2,1");
}

TEST(Frames, FrameNIsAtNOverFps) {
    EXPECT_EQ(FrameTime(0, 24), 0);
    EXPECT_EQ(FrameTime(24, 24), 1);
    EXPECT_EQ(FrameTime(1, 29.97), static_cast<float>(1 / 29.97));
}

TEST(FramePattern, PutsTheNumberWhereItBelongs) {
    EXPECT_EQ(FramePattern("-o", "out.####.exr").Name(7), "out.0007.exr");
    EXPECT_EQ(FramePattern("-o", "out.####.exr").Name(12345), "out.12345.exr");
    EXPECT_EQ(FramePattern("-o", "#").Name(12), "12");
    EXPECT_EQ(FramePattern("-o", "out.%04d.exr").Name(7), "out.0007.exr");
    EXPECT_EQ(FramePattern("-o", "%d.exr").Name(7), "7.exr");
    // Folders are no patterns.
    EXPECT_EQ(FramePattern("-o", "50%/#1/a#.exr").Name(7), "50%/#1/a7.exr");
}

TEST(FramePattern, FaultsSayWhatANameLooksLike) {
    for (const auto& [text, problem] : std::vector<std::pair<std::string, std::string>>{
             {"out.exr", "all frames would go into one file"},
             {"a#/out.exr", "all frames would go into one file"},
             {"##.##.exr", "more than one place"},
             {"%d#.exr", "more than one place"},
             {"100%.exr", "that of %d"},
             {"%4d.exr", "that of %d"},
             {"%s.exr", "that of %d"},
             {"%00d.exr", "that of %d"},
             {"##########.exr", "more than 9 digits"}}) {
        EXPECT_THAT(ProblemOfPattern(text), HasSubstr(problem)) << text;
        EXPECT_THAT(ProblemOfPattern(text), HasSubstr("-o " + text)) << text;
        EXPECT_THAT(ProblemOfPattern(text), HasSubstr("out.####.exr")) << text;
    }
}

}  // namespace
}  // namespace relume::client
