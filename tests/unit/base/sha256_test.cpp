#include "core/base/sha256.h"

#include <gtest/gtest.h>

namespace relume {
namespace {

// FIPS 180-4, examples of SHA-256.
TEST(Sha256, KnownDigests) {
    EXPECT_EQ(Sha256Hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(Sha256Hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(Sha256Hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
              "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    EXPECT_EQ(Sha256Hex(std::string(1'000'000, 'a')),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PartsAreAsGoodAsTheWhole) {
    const std::string text = "The way of a pixel, in parts of any size";
    for (std::size_t cut = 0; cut <= text.size(); ++cut) {
        Sha256 sha;
        sha.Update(text.substr(0, cut));
        Sha256 moved = std::move(sha);
        moved.Update(text.substr(cut));
        EXPECT_EQ(moved.HexDigest(), Sha256Hex(text));
    }
}

TEST(Sha256, OnlyLowerCaseDigestsAreFileNames) {
    const std::string digest = Sha256Hex("abc");
    EXPECT_TRUE(IsSha256Hex(digest));
    EXPECT_FALSE(IsSha256Hex(""));
    EXPECT_FALSE(IsSha256Hex(digest.substr(1)));
    EXPECT_FALSE(IsSha256Hex(digest + "0"));
    EXPECT_FALSE(IsSha256Hex(std::string("B") + digest.substr(1)));
    EXPECT_FALSE(IsSha256Hex(std::string("../") + digest.substr(3)));
    EXPECT_FALSE(IsSha256Hex(std::string("g") + digest.substr(1)));
}

}  // namespace
}  // namespace relume
