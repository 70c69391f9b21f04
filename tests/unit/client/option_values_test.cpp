#include "client/cli/option_values.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "core/base/error.h"

namespace relume::client {
namespace {

// The message with which `parse` refuses `text`; "" if it takes it.
template <typename Parse>
std::string Refusal(Parse parse, const std::string& text) {
    try {
        parse(text);
        return "";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
        return error.what();
    }
}

TEST(ParseSize, ReadsWidthAndHeight) {
    const Size size = ParseSize("1280x720");
    EXPECT_EQ(size.width, 1280);
    EXPECT_EQ(size.height, 720);
    EXPECT_EQ(ParseSize("65536x1024").width, 65536);
}

TEST(ParseSize, RefusesWithOptionValueAndRange) {
    for (const char* text :
         {"0x0", "1x0", "-1x5", "65537x1", "1e9x1e9", "1000000000x1000000000", "65536x65536",
          "1.5x2", "nanxnan", "infx1", "99999999999999999999x1"}) {
        const std::string message = Refusal(ParseSize, text);
        EXPECT_NE(message.find(std::string("--size ") + text), std::string::npos) << text;
        EXPECT_NE(message.find("1 to 65536"), std::string::npos) << message;
    }
    for (const char* text : {"", "1280", "x", "1280x", "x720", "1280x720x3", "1280X720", "axb",
                             "1280 x 720", "+1x1"}) {
        EXPECT_NE(Refusal(ParseSize, text).find("WIDTHxHEIGHT"), std::string::npos) << text;
    }
}

TEST(ParseVector, ReadsThreeNumbers) {
    EXPECT_EQ(ParseVector("--look-at", "1,-2.5,3e2"), (Vec3f{1, -2.5f, 300}));
    for (const char* text : {"", "1", "1,2", "1,2,3,4", "a,b,c", "1 2 3", "nan,0,0", "0,1e99,0"}) {
        const auto parse = [](const std::string& t) { return ParseVector("--look-at", t); };
        EXPECT_NE(Refusal(parse, text).find(std::string("--look-at ") + text), std::string::npos)
            << text;
    }
}

TEST(ParseCrop, ReadsARectangle) { EXPECT_EQ(ParseCrop("1,2,30,40"), (TileRect{1, 2, 30, 40})); }

TEST(ParseCrop, RefusesWhatIsNoRectangle) {
    EXPECT_NE(Refusal(ParseCrop, "5,5,5,9").find("empty"), std::string::npos);
    EXPECT_NE(Refusal(ParseCrop, "9,5,5,9").find("empty"), std::string::npos);
    EXPECT_NE(Refusal(ParseCrop, "-1,0,5,5").find("0 to 65536"), std::string::npos);
    EXPECT_NE(Refusal(ParseCrop, "0,0,1e9,5").find("0 to 65536"), std::string::npos);
    for (const char* text : {"", "1,2,3", "1,2,3,4,5", "a,b,c,d", "1 2 3 4", "1,2,3,"}) {
        EXPECT_NE(Refusal(ParseCrop, text).find("X0,Y0,X1,Y1"), std::string::npos) << text;
    }
}

TEST(ParsePositive, ReadsWholeAndBroken) {
    EXPECT_EQ(ParsePositive("--spp", 1 << 20, "8"), 8);
    EXPECT_EQ(ParsePositive("--spp", 1 << 20, "0.25"), 0.25);
    EXPECT_EQ(ParsePositive("--spp", 1 << 20, "1048576"), 1048576);
    EXPECT_EQ(ParsePositive("--target", 1000, "2e-3"), 0.002);
}

TEST(ParsePositive, RefusesWhatIsNoBudget) {
    const auto parse = [](const std::string& text) {
        return ParsePositive("--spp", 1 << 20, text);
    };
    for (const char* text :
         {"", "0", "-1", "nan", "inf", "1048577", "8 ", "8x", "eight", "1e999"}) {
        const std::string said =
            fmt::format("--spp {}: must be a number above 0 and at most 1048576", text);
        EXPECT_EQ(Refusal(parse, text), said);
    }
}

TEST(ParseCount, ReadsWholeNumbersAlone) {
    const auto parse = [](const std::string& text) {
        return ParseCount("--max-spp", 1 << 20, text);
    };
    EXPECT_EQ(parse("1"), 1u);
    EXPECT_EQ(parse("1048576"), 1048576u);
    for (const char* text : {"", "0", "-1", "nan", "1048577", "8.5", "many"}) {
        const std::string said =
            fmt::format("--max-spp {}: must be a whole number from 1 to 1048576", text);
        EXPECT_EQ(Refusal(parse, text), said);
    }
}

}  // namespace
}  // namespace relume::client
