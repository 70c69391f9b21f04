#include "core/image/decode.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <cstring>
#include <functional>

#include "core/base/error.h"
#include "core/image/exr.h"
#include "tests/unit/image/noise_images.h"

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#include <stb/stb_image_write.h>

namespace relume {
namespace {

using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::HasSubstr;

const std::vector<std::uint8_t> kRgba = {10, 20, 30, 255, 200, 100, 0,   128,
                                         0,  0,  0,  0,   255, 255, 255, 1};

std::string Png(int width, int height, std::uint32_t format, const void* pixels) {
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = static_cast<png_uint_32>(width);
    png.height = static_cast<png_uint_32>(height);
    png.format = format;
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
    std::string bytes(size, '\0');
    EXPECT_NE(png_image_write_to_memory(&png, bytes.data(), &size, 0, pixels, 0, nullptr), 0);
    bytes.resize(size);
    return bytes;
}

void Append(void* to, void* data, int size) {
    static_cast<std::string*>(to)->append(static_cast<const char*>(data),
                                          static_cast<std::size_t>(size));
}

std::string Jpeg(int width, int height, int channels, const std::vector<std::uint8_t>& pixels) {
    std::string bytes;
    stbi_write_jpg_to_func(Append, &bytes, width, height, channels, pixels.data(), 100);
    return bytes;
}

std::string Tga(int width, int height, int channels, const std::vector<std::uint8_t>& pixels,
                bool runs) {
    std::string bytes;
    stbi_write_tga_with_rle = runs ? 1 : 0;
    stbi_write_tga_to_func(Append, &bytes, width, height, channels, pixels.data());
    return bytes;
}

std::string Hdr(int width, int height, const std::vector<float>& rgb) {
    std::string bytes;
    stbi_write_hdr_to_func(Append, &bytes, width, height, 3, rgb.data());
    return bytes;
}

std::string FloatBytes(const std::vector<float>& values, bool swapped) {
    std::string bytes(values.size() * 4, '\0');
    std::memcpy(bytes.data(), values.data(), bytes.size());
    for (std::size_t i = 0; swapped && i < bytes.size(); i += 4) {
        std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(i),
                     bytes.begin() + static_cast<std::ptrdiff_t>(i + 4));
    }
    return bytes;
}

std::vector<std::uint8_t> Gradient(std::size_t count) {
    std::vector<std::uint8_t> pixels(count);
    for (std::size_t i = 0; i < count; ++i) {
        pixels[i] = static_cast<std::uint8_t>(i / 12 * 5);  // runs of equal pixels
    }
    return pixels;
}

Error Fails(const std::string& bytes) {
    try {
        DecodeImage(bytes, "picture");
    } catch (const Error& e) {
        EXPECT_THAT(e.what(), testing::StartsWith("picture: "));
        return e;
    }
    ADD_FAILURE() << "nothing was thrown";
    return {ErrorCode::kInternal, ""};
}

TEST(Decode, PngOfEveryKind) {
    DecodedImage image = DecodeImage(Png(2, 2, PNG_FORMAT_RGBA, kRgba.data()), "rgba.png");
    EXPECT_EQ(image.width, 2);
    EXPECT_EQ(image.height, 2);
    EXPECT_EQ(image.channels, 4);
    EXPECT_EQ(image.bytes, kRgba);
    EXPECT_TRUE(image.floats.empty());
    image = DecodeImage(Png(4, 1, PNG_FORMAT_RGB, kRgba.data()), "rgb.png");
    EXPECT_EQ(image.channels, 3);
    EXPECT_THAT(image.bytes, ElementsAreArray(kRgba.begin(), kRgba.begin() + 12));
    image = DecodeImage(Png(3, 1, PNG_FORMAT_GRAY, kRgba.data()), "grey.png");
    EXPECT_EQ(image.channels, 1);
    EXPECT_THAT(image.bytes, ElementsAre(10, 20, 30));
    image = DecodeImage(Png(1, 2, PNG_FORMAT_GA, kRgba.data()), "grey_alpha.png");
    EXPECT_EQ(image.channels, 2);
    EXPECT_THAT(image.bytes, ElementsAre(10, 20, 30, 255));
}

TEST(Decode, SixteenBitPngIsCutToEight) {
    const std::uint16_t values[] = {0x0000, 0x12ff, 0xff00, 0xffff};
    const DecodedImage image = DecodeImage(Png(4, 1, PNG_FORMAT_LINEAR_Y, values), "16.png");
    EXPECT_EQ(image.channels, 1);
    EXPECT_THAT(image.bytes, ElementsAre(0x00, 0x12, 0xff, 0xff));
}

TEST(Decode, Jpeg) {
    std::vector<std::uint8_t> pixels(8 * 8 * 3);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        pixels[i] = i % 3 == 0 ? 200 : 50;
    }
    DecodedImage image = DecodeImage(Jpeg(8, 8, 3, pixels), "red.jpg");
    EXPECT_EQ(image.channels, 3);
    ASSERT_EQ(image.bytes.size(), pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        EXPECT_NEAR(image.bytes[i], pixels[i], 3);  // rounding of the colour transform
    }
}

TEST(Decode, JpegWithTooManyHuffmanCodesIsRejected) {
    std::string bytes = Jpeg(8, 8, 3, std::vector<std::uint8_t>(8 * 8 * 3, 9));
    const auto table = bytes.find("\xff\xc4");
    ASSERT_NE(table, bytes.npos);
    // Marker, length and slot take five bytes; 16 counts follow.
    bytes.replace(table + 5, 16, 16, '\x20');
    EXPECT_THAT(Fails(bytes).what(), HasSubstr("Huffman"));
}

TEST(Decode, TgaFlatAndInRuns) {
    const auto pixels = Gradient(7 * 5 * 4);
    for (const bool runs : {false, true}) {
        DecodedImage image = DecodeImage(Tga(7, 5, 4, pixels, runs), "a.tga");
        EXPECT_EQ(image.width, 7);
        EXPECT_EQ(image.height, 5);
        EXPECT_EQ(image.channels, 4);
        EXPECT_EQ(image.bytes, pixels);
    }
}

TEST(Decode, RadianceFlatAndInRuns) {
    // Widths below 8 are never run-length encoded. The values are exact in RGBE.
    for (const int width : {3, 40}) {
        std::vector<float> rgb(static_cast<std::size_t>(width) * 2 * 3);
        for (std::size_t i = 0; i < rgb.size(); ++i) {
            rgb[i] = static_cast<float>(i / 21 * 16 + (i % 3)) * 0.125f;
        }
        const DecodedImage image = DecodeImage(Hdr(width, 2, rgb), "sky.hdr");
        EXPECT_EQ(image.width, width);
        EXPECT_EQ(image.height, 2);
        EXPECT_EQ(image.channels, 3);
        EXPECT_TRUE(image.bytes.empty());
        EXPECT_EQ(image.floats, rgb);
    }
}

TEST(Decode, RadianceThatIsNoRgbeOrNotFromTheTopIsRejected) {
    EXPECT_THAT(Fails("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n1234").what(),
                HasSubstr("32-bit_rle_xyze"));
    EXPECT_THAT(Fails("#?RGBE\n\n+X 1 -Y 1\n1234").what(), HasSubstr("rows from the top"));
    EXPECT_EQ(Fails("#?RADIANCE\n\n-Y 9999999 +X 9999999\n").code(), ErrorCode::kResourceExhausted);
    // A run of length 0, and one that leaves the line.
    const std::string start = std::string("#?RADIANCE\n\n-Y 1 +X 8\n\2\2\0\10", 27);
    EXPECT_THAT(Fails(start + std::string(40, '\0')).what(), HasSubstr("run"));
    EXPECT_THAT(Fails(start + "\x89" + std::string(40, '1')).what(), HasSubstr("run"));
}

TEST(Decode, PfmInBothByteOrdersFromTheBottom) {
    const std::vector<float> rows = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};  // bottom row first
    const std::vector<float> top_first = {7, 8, 9, 10, 11, 12, 1, 2, 3, 4, 5, 6};
    DecodedImage image = DecodeImage("PF\n2 2\n-1.0\n" + FloatBytes(rows, false), "a.pfm");
    EXPECT_EQ(image.width, 2);
    EXPECT_EQ(image.height, 2);
    EXPECT_EQ(image.channels, 3);
    EXPECT_EQ(image.floats, top_first);
    image = DecodeImage("PF\n2 2\n1.0\n" + FloatBytes(rows, true), "a.pfm");
    EXPECT_EQ(image.floats, top_first);
    image = DecodeImage("Pf\n2\n1\n-2\n" + FloatBytes({3, 4}, false), "grey.pfm");
    EXPECT_EQ(image.channels, 1);
    EXPECT_THAT(image.floats, ElementsAre(6, 8));
}

TEST(Decode, PfmWithABadHeaderIsRejected) {
    EXPECT_THAT(Fails("PF\ntwo 2\n-1\n").what(), HasSubstr("'two'"));
    EXPECT_EQ(Fails("PF\n0 2\n-1\n").code(), ErrorCode::kInvalidArgument);
    EXPECT_EQ(Fails("PF\n-3 2\n-1\n").code(), ErrorCode::kInvalidArgument);
    EXPECT_EQ(Fails("PF\n2 2\nnan\n" + std::string(48, '0')).code(), ErrorCode::kDataLoss);
    EXPECT_EQ(Fails("PF\n1 1\n0\n" + std::string(12, '0')).code(), ErrorCode::kDataLoss);
    EXPECT_EQ(Fails("PF\n1000000 1000000\n-1\n").code(), ErrorCode::kResourceExhausted);
}

TEST(Decode, Exr) {
    Image exr(2, 1, {"A", "B", "G", "R", "Z"});
    exr.Plane("R")[1] = 5;
    exr.Plane("G")[1] = 6;
    exr.Plane("B")[1] = 7;
    exr.Plane("A")[1] = 1;
    DecodedImage image = DecodeImage(EncodeExr(exr), "a.exr");
    EXPECT_EQ(image.channels, 4);
    EXPECT_THAT(image.floats, ElementsAre(0, 0, 0, 0, 5, 6, 7, 1));
    Image grey(1, 1, {"luma"});
    grey.Plane("luma")[0] = 3;
    image = DecodeImage(EncodeExr(grey), "grey.exr");
    EXPECT_EQ(image.channels, 1);
    EXPECT_THAT(image.floats, ElementsAre(3));
    EXPECT_THAT(Fails(EncodeExr(Image(1, 1, {"N.X", "N.Z"}))).what(), HasSubstr("N.X, N.Z"));
}

TEST(Decode, WhatIsNoPictureIsRejected) {
    for (const std::string& bytes :
         {std::string(), std::string("solid cube"), std::string(100, 'x'), std::string("GIF89a"),
          std::string(17, '\0')}) {
        const Error error = Fails(bytes);
        EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
        EXPECT_THAT(error.what(), HasSubstr("is not a PNG, JPEG, TGA"));
    }
}

TEST(Decode, HugePicturesAreRejectedByTheirHeader) {
    std::string png = Png(2, 2, PNG_FORMAT_RGBA, kRgba.data());
    png.replace(16, 8, std::string("\0\1\0\0\0\1\0\0", 8));  // 65536 x 65536
    EXPECT_EQ(Fails(png).code(), ErrorCode::kResourceExhausted);
    std::string tga = Tga(2, 2, 4, kRgba, false);
    tga.replace(12, 4, "\xff\xff\xff\xff");
    EXPECT_EQ(Fails(tga).code(), ErrorCode::kResourceExhausted);
}

// Files of each format, large enough for the readers' buffers to be filled more than once.
std::vector<std::string> Files() {
    const auto pixels = Gradient(40 * 24 * 4);
    std::vector<float> rgb(40 * 24 * 3);
    Lcg random(3);
    for (auto& value : rgb) {
        value = static_cast<float>(random.Next());
    }
    return {Png(40, 24, PNG_FORMAT_RGBA, pixels.data()),
            Jpeg(40, 24, 3, pixels),
            Tga(40, 24, 4, pixels, false),
            Tga(40, 24, 4, pixels, true),
            Hdr(40, 24, rgb),
            "PF\n40 24\n-1\n" + FloatBytes(rgb, false),
            EncodeExr(NoisePair(40, 24, 1, false).first)};
}

TEST(Decode, EveryTruncationIsAnError) {
    for (const auto& bytes : Files()) {
        EXPECT_EQ(DecodeImage(bytes, "picture").width, 40);
        // stb's TGA has a footer of 26 bytes, and a PNG ends in 12 bytes that carry no pixels.
        const std::size_t end = bytes.size() - 27;
        for (std::size_t size = 0; size < end; size += size < 200 ? 1 : 41) {
            SCOPED_TRACE(testing::Message() << bytes.substr(0, 4) << " of " << size << " bytes");
            Fails(bytes.substr(0, size));
        }
    }
}

TEST(Decode, DamagedBytesNeverCrash) {
    Lcg random(5);
    for (const auto& good : Files()) {
        for (int i = 0; i < 300; ++i) {
            std::string bytes = good;
            for (int k = 0; k < 4; ++k) {
                const double range = i % 2 == 0 ? 64.0 : static_cast<double>(bytes.size());
                bytes[static_cast<std::size_t>(random.Next() * range)] =
                    static_cast<char>(random.Next() * 256);
            }
            try {
                const DecodedImage image = DecodeImage(bytes, "picture");
                EXPECT_EQ(image.bytes.size() + image.floats.size(),
                          static_cast<std::size_t>(image.width) *
                              static_cast<std::size_t>(image.height) *
                              static_cast<std::size_t>(image.channels));
            } catch (const Error& e) {
                EXPECT_THAT(e.what(), testing::StartsWith("picture: "));
            }
        }
    }
}

}  // namespace
}  // namespace relume
