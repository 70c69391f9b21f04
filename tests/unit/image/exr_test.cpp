#include "core/image/exr.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/files.h"
#include "tests/unit/image/noise_images.h"

namespace relume {
namespace {

Image Sample() {
    auto [image, other] = NoisePair(37, 21, 1, true);
    image.Add("noisy.R");
    image.Add("Z");
    image.Add("a layer with a name of more than thirty-one letters.Y");
    for (std::size_t i = 0; i < image.pixel_count(); ++i) {
        image.Plane("Z")[i] = static_cast<float>(i) * 0.1f;
    }
    image.Plane("Z")[3] = -0.0f;
    image.Plane("Z")[4] = std::numeric_limits<float>::denorm_min();
    image.Plane("Z")[5] = std::numeric_limits<float>::max();
    image.SetWindow(100, 50, 640, 480);
    image.metadata()["relume.scene"] = "0123abcd";
    image.metadata()["relume.settings"] = "{\"spp\": 8}\nsecond line, \xc3\xa4";
    image.metadata()["empty"] = "";
    return image;
}

Error Fails(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& e) {
        return e;
    }
    ADD_FAILURE() << "nothing was thrown";
    return {ErrorCode::kInternal, ""};
}

TEST(Exr, RoundTripKeepsEveryBit) {
    const Image image = Sample();
    const Image read = ParseExr(EncodeExr(image), "test.exr");
    EXPECT_EQ(ImageDigest(read), ImageDigest(image));
    EXPECT_EQ(read.metadata(), image.metadata());
    EXPECT_EQ(read.x0(), 100);
    EXPECT_EQ(read.y0(), 50);
    EXPECT_EQ(read.width(), 37);
    EXPECT_EQ(read.height(), 21);
    EXPECT_EQ(read.display_width(), 640);
    EXPECT_EQ(read.display_height(), 480);
    EXPECT_TRUE(std::signbit(read.Plane("Z")[3]));
}

TEST(Exr, RoundTripKeepsWindowsBeyondTheFrame) {
    Image image(5, 3, {"Y"});
    image.SetWindow(-4, -2, 3, 2);
    const Image read = ParseExr(EncodeExr(image), "test.exr");
    EXPECT_EQ(ImageDigest(read), ImageDigest(image));
    EXPECT_EQ(read.x0(), -4);
}

TEST(Exr, OnePixelRoundTrips) {
    Image image(1, 1, {"Z"});
    image.Plane("Z")[0] = 7;
    EXPECT_EQ(ParseExr(EncodeExr(image), "test.exr").Plane("Z")[0], 7);
}

TEST(Exr, BytesAreTheSameEachTime) { EXPECT_EQ(EncodeExr(Sample()), EncodeExr(Sample())); }

TEST(Exr, CompressesWithZip) {
    // 3 MB of zeros.
    EXPECT_LT(EncodeExr(Image(512, 512, {"R", "G", "B"})).size(), 100'000u);
}

TEST(Exr, FilesRoundTrip) {
    const TemporaryFolder folder;
    const auto path = folder.path() / "image.exr";
    WriteExr(path, Sample());
    EXPECT_EQ(ImageDigest(ReadExr(path)), ImageDigest(Sample()));
}

TEST(Exr, AMissingFileIsNamed) {
    const TemporaryFolder folder;
    const Error error = Fails([&] { ReadExr(folder.path() / "missing.exr"); });
    EXPECT_EQ(error.code(), ErrorCode::kNotFound);
    EXPECT_THAT(error.what(), testing::HasSubstr("missing.exr"));
}

TEST(Exr, WritingNowhereIsNamed) {
    const TemporaryFolder folder;
    const Error error = Fails([&] { WriteExr(folder.path() / "no/such/image.exr", Sample()); });
    EXPECT_THAT(error.what(), testing::HasSubstr("no/such/image.exr"));
}

TEST(Exr, WhatIsNoExrIsRejected) {
    for (const char* bytes : {"", "v/1", "PNG or so", "\x89PNG\r\n\x1a\n"}) {
        const Error error = Fails([&] { ParseExr(bytes, "picture.exr"); });
        EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
        EXPECT_STREQ(error.what(), "picture.exr: is not an OpenEXR file; convert it");
    }
}

TEST(Exr, EveryTruncationIsAnErrorThatNamesTheFile) {
    const std::string bytes = EncodeExr(Sample());
    for (std::size_t size = 4; size < bytes.size(); size += size < 900 ? 1 : 97) {
        const Error error =
            Fails([&] { ParseExr(std::string_view(bytes).substr(0, size), "cut.exr"); });
        EXPECT_THAT(error.what(), testing::StartsWith("cut.exr: ")) << size << " bytes";
    }
}

TEST(Exr, DamagedBytesNeverCrash) {
    const std::string good = EncodeExr(Sample());
    Lcg random(11);
    int rejected = 0;
    for (int i = 0; i < 2000; ++i) {
        std::string bytes = good;
        for (int k = 0; k < 3; ++k) {
            // Half of them in the header.
            const double range = i % 2 == 0 ? 700.0 : static_cast<double>(bytes.size());
            bytes[static_cast<std::size_t>(random.Next() * range)] =
                static_cast<char>(random.Next() * 256);
        }
        try {
            ParseExr(bytes, "damaged.exr");
        } catch (const Error& e) {
            EXPECT_THAT(e.what(), testing::StartsWith("damaged.exr: "));
            ++rejected;
        }
    }
    EXPECT_GT(rejected, 500);
}

TEST(Exr, HugeWindowsAreRejectedBeforeMemoryIsTaken) {
    std::string bytes = EncodeExr(Image(4, 4, {"Y"}));
    const auto at = bytes.find("dataWindow") + std::string("dataWindow.box2i.????").size();
    const auto with_corner = [&](std::int32_t x, std::int32_t y) {
        std::string changed = bytes;
        changed.replace(at + 8, 4, reinterpret_cast<const char*>(&x), 4);
        changed.replace(at + 12, 4, reinterpret_cast<const char*>(&y), 4);
        return changed;
    };
    EXPECT_EQ(ParseExr(with_corner(3, 3), "same.exr").width(), 4);
    Error error = Fails([&] { ParseExr(with_corner(1 << 20, 1 << 20), "huge.exr"); });
    EXPECT_EQ(error.code(), ErrorCode::kResourceExhausted);
    EXPECT_THAT(error.what(), testing::HasSubstr("huge.exr: 1048577x1048577 pixels"));
    // Allowed as such, but no such file is this short.
    error = Fails([&] { ParseExr(with_corner((1 << 14) - 1, (1 << 14) - 1), "short.exr"); });
    EXPECT_EQ(error.code(), ErrorCode::kDataLoss);
    EXPECT_STREQ(error.what(), "short.exr: the EXR is truncated; restore the file");
}

TEST(Exr, NoMethodPacksGigabytesIntoAFewBytes) {
    std::string bytes = EncodeExr(Image(4, 4, {"R", "G"}));
    const auto method =
        bytes.find("compression") + std::string("compression.compression.????").size();
    const auto window = bytes.find("dataWindow") + std::string("dataWindow.box2i.????").size();
    const std::int32_t last = (1 << 14) - 1;  // 2^29 values, 2 GiB
    bytes.replace(window + 8, 4, reinterpret_cast<const char*>(&last), 4);
    bytes.replace(window + 12, 4, reinterpret_cast<const char*>(&last), 4);
    bytes.resize(8192);                         // with 2^18 values a byte, it might be whole
    for (const int packed_by : {4, 6, 8, 9}) {  // PIZ, B44, DWAA, DWAB
        bytes[method] = static_cast<char>(packed_by);
        const Error error = Fails([&] { ParseExr(bytes, "short.exr"); });
        EXPECT_STREQ(error.what(), "short.exr: the EXR is truncated; restore the file")
            << packed_by;
    }
}

TEST(Exr, AnEmptyImageIsNotWritten) {
    EXPECT_EQ(Fails([] { EncodeExr(Image(0, 0, {"R"})); }).code(), ErrorCode::kInvalidArgument);
    EXPECT_EQ(Fails([] { EncodeExr(Image(1, 1)); }).code(), ErrorCode::kInvalidArgument);
}

TEST(Exr, MetadataThatWouldReplaceTheHeaderIsRejected) {
    Image image(1, 1, {"Y"});
    image.metadata()["dataWindow"] = "none";
    EXPECT_EQ(Fails([&] { EncodeExr(image); }).code(), ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace relume
