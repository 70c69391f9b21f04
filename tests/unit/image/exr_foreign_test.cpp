// EXR files as other programs write them: half and uint channels, tiles, other compressions, many
// parts, a display window that does not begin at 0.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfTiledOutputFile.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <half.h>

#include <array>
#include <numeric>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/exr.h"

namespace relume {
namespace {

constexpr int kWidth = 23, kHeight = 17;

class ForeignExr : public testing::Test {
  protected:
    ForeignExr()
        : path_((folder_.path() / "foreign.exr").string()), floats_(kWidth * kHeight), uints_() {
        for (std::size_t i = 0; i < floats_.size(); ++i) {
            floats_[i] = static_cast<float>(i) * 0.25f;  // exact as half, too
            halves_.emplace_back(floats_[i]);
            uints_.push_back(static_cast<unsigned>(i) * 3);
        }
    }

    Imf::Slice Slice(Imf::PixelType type) {
        const Imath::V2i origin(0, 0);
        switch (type) {
            case Imf::HALF:
                return Imf::Slice::Make(type, halves_.data(), origin, kWidth, kHeight);
            case Imf::UINT:
                return Imf::Slice::Make(type, uints_.data(), origin, kWidth, kHeight);
            default:
                return Imf::Slice::Make(type, floats_.data(), origin, kWidth, kHeight);
        }
    }

    void ExpectPixels(const Image& image, const std::string& channel, float scale = 1) {
        ASSERT_EQ(image.width(), kWidth);
        ASSERT_EQ(image.height(), kHeight);
        for (std::size_t i = 0; i < floats_.size(); ++i) {
            ASSERT_EQ(image.Plane(channel)[i], floats_[i] * scale) << channel << " " << i;
        }
    }

    TemporaryFolder folder_;
    std::string path_;
    std::vector<float> floats_;
    std::vector<half> halves_;
    std::vector<unsigned> uints_;
};

TEST_F(ForeignExr, HalfFloatAndUintChannelsAreRead) {
    for (const auto compression :
         {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::PIZ_COMPRESSION}) {
        Imf::Header header(kWidth, kHeight, 1, {0, 0}, 1, Imf::DECREASING_Y, compression);
        Imf::FrameBuffer frame;
        const std::array<std::pair<const char*, Imf::PixelType>, 3> channels = {
            {{"half", Imf::HALF}, {"float", Imf::FLOAT}, {"uint", Imf::UINT}}};
        for (const auto& [name, type] : channels) {
            header.channels().insert(name, Imf::Channel(type));
            frame.insert(name, Slice(type));
        }
        {
            Imf::OutputFile file(path_.c_str(), header, 0);
            file.setFrameBuffer(frame);
            // From the last line to the first, as the header says.
            file.writePixels(kHeight);
        }
        const Image image = ReadExr(path_);
        ExpectPixels(image, "half");
        ExpectPixels(image, "float");
        ExpectPixels(image, "uint", 12);  // 3 i against 0.25 i
    }
}

TEST_F(ForeignExr, TilesWithLevelsAreRead) {
    Imf::Header header(kWidth, kHeight);
    header.channels().insert("Y", Imf::Channel(Imf::HALF));
    header.setTileDescription(Imf::TileDescription(8, 8, Imf::MIPMAP_LEVELS));
    Imf::FrameBuffer frame;
    frame.insert("Y", Slice(Imf::HALF));
    {
        Imf::TiledOutputFile file(path_.c_str(), header, 0);
        file.setFrameBuffer(frame);
        for (int level = 0; level < file.numLevels(); ++level) {
            file.writeTiles(0, file.numXTiles(level) - 1, 0, file.numYTiles(level) - 1, level);
        }
    }
    ExpectPixels(ReadExr(path_), "Y");
    const std::string bytes = ReadFile(path_);
    EXPECT_THROW(ParseExr(std::string_view(bytes).substr(0, bytes.size() / 2), "cut"), Error);
}

TEST_F(ForeignExr, TheFirstPartIsRead) {
    std::array<Imf::Header, 2> headers = {Imf::Header(kWidth, kHeight),
                                          Imf::Header(kWidth, kHeight)};
    for (auto& header : headers) {
        header.setType(Imf::SCANLINEIMAGE);
        header.channels().insert("Y", Imf::Channel(Imf::FLOAT));
    }
    headers[0].setName("first");
    headers[1].setName("second");
    Imf::FrameBuffer frame;
    frame.insert("Y", Slice(Imf::FLOAT));
    {
        Imf::MultiPartOutputFile file(path_.c_str(), headers.data(), 2, false, 0);
        Imf::OutputPart first(file, 0), second(file, 1);
        first.setFrameBuffer(frame);
        first.writePixels(kHeight);
        second.setFrameBuffer(frame);
        second.writePixels(kHeight);
    }
    const Image image = ReadExr(path_);
    ExpectPixels(image, "Y");
    EXPECT_TRUE(image.metadata().empty());
    ExpectPixels(ParseExr(EncodeExr(image), "again"), "Y");
}

TEST_F(ForeignExr, WindowsAreRelativeToTheDisplayWindow) {
    const Imath::Box2i display({-10, 20}, {89, 69}), data({0, 0}, {kWidth - 1, kHeight - 1});
    Imf::Header header(display, data);
    header.channels().insert("Y", Imf::Channel(Imf::FLOAT));
    Imf::FrameBuffer frame;
    frame.insert("Y", Slice(Imf::FLOAT));
    {
        Imf::OutputFile file(path_.c_str(), header, 0);
        file.setFrameBuffer(frame);
        file.writePixels(kHeight);
    }
    const Image image = ReadExr(path_);
    ExpectPixels(image, "Y");
    EXPECT_EQ(image.x0(), 10);
    EXPECT_EQ(image.y0(), -20);
    EXPECT_EQ(image.display_width(), 100);
    EXPECT_EQ(image.display_height(), 50);
}

TEST_F(ForeignExr, AFileThatWasNotFinishedIsAnError) {
    Imf::Header header(kWidth, kHeight);
    header.channels().insert("Y", Imf::Channel(Imf::FLOAT));
    Imf::FrameBuffer frame;
    frame.insert("Y", Slice(Imf::FLOAT));
    {
        Imf::OutputFile file(path_.c_str(), header, 0);
        file.setFrameBuffer(frame);
        file.writePixels(1);
    }
    try {
        ReadExr(path_);
        FAIL() << "nothing was thrown";
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::kDataLoss);
        EXPECT_THAT(e.what(), testing::HasSubstr("foreign.exr: the EXR is damaged"));
    }
}

TEST_F(ForeignExr, SubsampledChannelsAreRejectedByName) {
    Imf::Header header(24, 16);
    header.channels().insert("BY", Imf::Channel(Imf::HALF, 2, 2));
    Imf::FrameBuffer frame;
    frame.insert("BY", Imf::Slice::Make(Imf::HALF, halves_.data(), {0, 0}, 24, 16, 0, 0, 2, 2));
    {
        Imf::OutputFile file(path_.c_str(), header, 0);
        file.setFrameBuffer(frame);
        file.writePixels(16);
    }
    try {
        ReadExr(path_);
        FAIL() << "nothing was thrown";
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::kUnimplemented);
        EXPECT_THAT(e.what(), testing::HasSubstr("channel 'BY' is subsampled"));
    }
}

}  // namespace
}  // namespace relume
