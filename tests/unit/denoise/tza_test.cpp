#include "server/denoise/network/tza.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/base/error.h"
#include "core/base/files.h"
#include "server/denoise/network/half_floats.h"
#include "tests/unit/denoise/reference_network.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::HasSubstr;

TensorArchive Parse(const std::string& bytes) {
    return ParseTza(std::as_bytes(std::span(bytes)), "some.tza");
}

TensorArchive Example() {
    TensorArchive archive;
    AddWeights("first", 3, 2, 3, 1, &archive);
    AddWeights("second", 2, 3, 5, 2, &archive);
    return archive;
}

TEST(HalfFloats, ReadAndWriteAllValues) {
    for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
        const auto half = static_cast<std::uint16_t>(bits);
        const float value = HalfToFloat(half);
        if (std::isnan(value)) {
            EXPECT_TRUE(std::isnan(HalfToFloat(FloatToHalf(value))));
        } else {
            EXPECT_EQ(FloatToHalf(value), half);
        }
    }
    EXPECT_EQ(HalfToFloat(0x3c00), 1);
    EXPECT_EQ(HalfToFloat(0xc000), -2);
    EXPECT_EQ(HalfToFloat(0x7bff), 65504);
    EXPECT_EQ(HalfToFloat(0x0001), 0x1p-24f);
    EXPECT_EQ(HalfToFloat(0x7c00), INFINITY);
}

TEST(HalfFloats, RoundToTheNearest) {
    EXPECT_EQ(FloatToHalf(1 + 0x1p-11f), 0x3c00);             // between two: even
    EXPECT_EQ(FloatToHalf(1 + 3 * 0x1p-11f), 0x3c02);         // between two: even
    EXPECT_EQ(FloatToHalf(1 + 0x1p-11f + 0x1p-20f), 0x3c01);  // nearer to the upper
    EXPECT_EQ(FloatToHalf(65519), 0x7bff);
    EXPECT_EQ(FloatToHalf(65520), 0x7c00);
    EXPECT_EQ(FloatToHalf(-1e9f), 0xfc00);
    EXPECT_EQ(FloatToHalf(0x1p-25f), 0x0000);
    EXPECT_EQ(FloatToHalf(0x1.8p-25f), 0x0001);
    EXPECT_EQ(FloatToHalf(-0x1.8p-24f), 0x8002);
}

TEST(Tza, ReadsWhatItWrites) {
    const TensorArchive archive = Example();
    const TensorArchive floats = Parse(FormatTza(archive, TensorType::kFloat));
    const TensorArchive halves = Parse(FormatTza(archive, TensorType::kHalf));
    ASSERT_EQ(floats.size(), 4u);
    ASSERT_EQ(halves.size(), 4u);
    for (const auto& [name, tensor] : archive) {
        EXPECT_EQ(floats.at(name).shape, tensor.shape);
        EXPECT_EQ(floats.at(name).values, tensor.values);
        EXPECT_EQ(halves.at(name).shape, tensor.shape);
        ASSERT_EQ(halves.at(name).values.size(), tensor.values.size());
        for (std::size_t i = 0; i < tensor.values.size(); ++i) {
            EXPECT_EQ(halves.at(name).values[i], HalfToFloat(FloatToHalf(tensor.values[i])));
        }
    }
}

// Bytes as Open Image Denoise lays them out.
TEST(Tza, HasTheKnownLayout) {
    const std::string bytes = FormatTza({{"ab", {{1}, {1.0f}}}}, TensorType::kHalf);
    std::string expected(128, '\0');
    expected.replace(0, 5, "\xd7\x41\x02\x00\x80", 5);  // magic, version 2.0, table at 128
    expected.replace(64, 2, std::string("\x00\x3c", 2));
    expected += std::string(
        "\x01\0\0\0"
        "\x02\0ab"
        "\x01"
        "\x01\0\0\0"
        "xh"
        "\x40\0\0\0\0\0\0\0",
        23);
    EXPECT_EQ(bytes, expected);
}

TEST(Tza, WhatIsCutOffIsRefused) {
    const std::string bytes = FormatTza(Example(), TensorType::kHalf);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        EXPECT_THAT(MessageOf([&] { (void)Parse(bytes.substr(0, size)); }), HasSubstr("some.tza"))
            << size;
    }
}

TEST(Tza, EveryChangedByteIsReadOrRefused) {
    const std::string bytes = FormatTza(Example(), TensorType::kFloat);
    for (std::size_t at = 0; at < bytes.size(); ++at) {
        for (const char value : {'\0', '\x7f', '\xff'}) {
            std::string changed = bytes;
            changed[at] = value;
            try {
                (void)Parse(changed);
            } catch (const Error& error) {
                EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
            }
        }
    }
}

TEST(Tza, SaysWhatIsWrong) {
    const auto message = [](std::size_t at, const std::string& with) {
        std::string bytes = FormatTza({{"ab", {{1}, {1.0f}}}}, TensorType::kHalf);
        bytes.replace(at, with.size(), with);
        return MessageOf([&] { (void)Parse(bytes); });
    };
    EXPECT_THAT(message(0, "PK"), HasSubstr("magic"));
    EXPECT_THAT(message(2, "\x03"), HasSubstr("version 3"));
    EXPECT_THAT(message(4, "\xff"), HasSubstr("beyond the end"));
    EXPECT_THAT(message(137, std::string(1, '\0')), HasSubstr("side of 0"));
    EXPECT_THAT(message(140, "\x7f"), HasSubstr("side of"));
    EXPECT_THAT(message(141, "y"), HasSubstr("layout"));
    EXPECT_THAT(message(142, "d"), HasSubstr("type"));
    EXPECT_THAT(MessageOf([] { (void)ReadTza("/nowhere/some.tza"); }), HasSubstr("/nowhere/some"));
}

}  // namespace
}  // namespace relume::denoise
