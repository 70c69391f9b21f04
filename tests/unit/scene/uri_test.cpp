#include "core/scene/uri.h"

#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(Uri, RelativeNamesAreDecodedAndSimplified) {
    EXPECT_EQ(UriToName("a.png", "p"), "a.png");
    EXPECT_EQ(UriToName("maps/a%20b.png", "p"), "maps/a b.png");
    EXPECT_EQ(UriToName("./maps/./a.png", "p"), "maps/a.png");
    EXPECT_EQ(UriToName("maps/../a.png", "p"), "a.png");
    EXPECT_EQ(UriToName("100%.png", "p"), "100%.png");  // exporters forget to escape it
    EXPECT_EQ(UriToName("caf%C3%A9.png", "p"), "caf\xc3\xa9.png");
}

TEST(Uri, WhatLeavesTheFolderIsRefusedWithItsPlace) {
    for (const char* uri : {"", "/a", "..", "../a", "a/../../b", "a/..", "%2e%2e%2fa", "a\\b",
                            "a//b", "a/", "a%00b"}) {
        EXPECT_THAT(MessageOf([&] { UriToName(uri, "x.gltf: image 2"); }),
                    AllOf(HasSubstr("x.gltf: image 2"), HasSubstr("relative")))
            << uri;
    }
    for (const char* uri : {"http://example.org/a", "file:///a", "C:/a.png"}) {
        EXPECT_THAT(MessageOf([&] { UriToName(uri, "x.gltf: image 2"); }),
                    AllOf(HasSubstr("x.gltf: image 2"), HasSubstr("not a file")))
            << uri;
    }
}

TEST(Uri, DataUris) {
    EXPECT_TRUE(IsDataUri("data:,x"));
    EXPECT_FALSE(IsDataUri("data.bin"));
    EXPECT_EQ(DecodeDataUri("data:,a%20b", "p"), "a b");
    EXPECT_EQ(DecodeDataUri("data:text/plain;base64,aGVsbG8=", "p"), "hello");
    EXPECT_EQ(DecodeDataUri("data:;base64,aGVsbG8", "p"), "hello");
    EXPECT_EQ(DecodeDataUri("data:;base64,-_-_", "p"), DecodeDataUri("data:;base64,+/+/", "p"));
    EXPECT_EQ(DecodeDataUri("data:;base64,", "p"), "");
}

TEST(Uri, Base64OfEveryLengthComesBack) {
    std::string bytes;
    for (int i = 0; i < 300; ++i) {
        EXPECT_EQ(DecodeDataUri("data:;base64," + Base64(bytes), "p"), bytes) << i;
        bytes.push_back(static_cast<char>((i * 37) & 255));
    }
}

TEST(Uri, MalformedDataUrisNameTheirPlace) {
    EXPECT_THAT(MessageOf([] { DecodeDataUri("data:text", "x: buffer 0"); }),
                HasSubstr("x: buffer 0: its data URI has no comma"));
    EXPECT_THAT(MessageOf([] { DecodeDataUri("data:;base64,a b", "x: buffer 0"); }),
                HasSubstr("x: buffer 0: its data URI is not base64"));
}

}  // namespace
}  // namespace relume::test
