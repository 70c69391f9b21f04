#include "core/scene/image_header.h"

#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using namespace std::string_literals;
using testing::AllOf;
using testing::HasSubstr;

// Signature, IHDR and IEND; the CRCs are not looked at.
const std::string kPng =
    "\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\x01\x02\0\0\x00\x03\x08\x02\0\0\0CRC_\0\0\0\0IENDCRC_"s;
// An application segment, a frame of 258x3, an end.
const std::string kJpeg =
    "\xff\xd8\xff\xe0\0\x04xx\xff\xff\xc2\0\x0b\x08\0\x03\x01\x02\x01\x01\x11\0\xff\xd9"s;
// Data window (2,1) to (259,3).
const std::string kExr =
    "\x76\x2f\x31\x01\x02\0\0\0owner\0string\0\x03\0\0\0abcdataWindow\0box2i\0\x10\0\0\0"
    "\x02\0\0\0\x01\0\0\0\x03\x01\0\0\x03\0\0\0\0"s;
const std::string kPfm = "PF\n2 3\n-1.0\n"s + std::string(72, '\0');

void ExpectSize(const std::string& bytes, int width, int height) {
    const ImageSize size = ReadImageHeader(bytes, "a");
    EXPECT_EQ(size.width, width);
    EXPECT_EQ(size.height, height);
}

TEST(ImageHeader, SizeOfEveryFormat) {
    ExpectSize(kPng, 258, 3);
    ExpectSize(kJpeg, 258, 3);
    ExpectSize(kExr, 258, 3);
    ExpectSize(kPfm, 2, 3);
    ExpectSize("Pf\n2\n3\n1\n"s + std::string(24, '\0'), 2, 3);
    ExpectSize(HdrPicture(7, 3, 1, 2, 3, 128), 7, 3);
    ExpectSize(TgaPicture(258, 3, 1, 2, 3), 258, 3);
}

TEST(ImageHeader, EveryPrefixOfPngJpegAndPfmIsAnErrorThatNamesTheFile) {
    for (const std::string& whole : {kPng, kJpeg, kPfm}) {
        for (std::size_t size = 0; size < whole.size(); ++size) {
            EXPECT_THAT(MessageOf([&] { ReadImageHeader(whole.substr(0, size), "p.png"); }),
                        HasSubstr("p.png: "))
                << size;
        }
    }
}

TEST(ImageHeader, PrefixesOfTheOtherHeadersAreErrorsToo) {
    const std::string hdr = HdrPicture(7, 3, 1, 2, 3, 128);
    for (std::size_t size = 0; size + 84 < hdr.size(); ++size) {
        EXPECT_THAT(MessageOf([&] { ReadImageHeader(hdr.substr(0, size), "h"); }),
                    HasSubstr("h: "));
    }
    for (std::size_t size = 0; size + 1 < kExr.size(); ++size) {
        EXPECT_THAT(MessageOf([&] { ReadImageHeader(kExr.substr(0, size), "e"); }),
                    HasSubstr("e: "));
    }
}

TEST(ImageHeader, WhatIsNoPictureIsSaid) {
    EXPECT_THAT(MessageOf([] { ReadImageHeader("GIF89a...............", "a.gif"); }),
                AllOf(HasSubstr("a.gif"), HasSubstr("convert it")));
    std::string empty = kPng;
    empty[23] = '\0';
    EXPECT_THAT(MessageOf([&] { ReadImageHeader(empty, "a"); }), HasSubstr("no pixels"));
    std::string flipped = HdrPicture(7, 3, 1, 2, 3, 128);
    flipped[flipped.find("-Y")] = '+';
    EXPECT_THAT(MessageOf([&] { ReadImageHeader(flipped, "a"); }), HasSubstr("rows from the top"));
    std::string inverted = kExr;
    inverted[inverted.size() - 17 + 8] = '\0';
    inverted[inverted.size() - 17 + 9] = '\0';
    EXPECT_THAT(MessageOf([&] { ReadImageHeader(inverted, "a"); }), HasSubstr("a: "));
}

}  // namespace
}  // namespace relume::test
