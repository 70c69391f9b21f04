#include "core/base/xxh64.h"

#include <gtest/gtest.h>

#include <string>

namespace relume {
namespace {

// By libxxhash 0.8.1, of the first `size` of the bytes 3, 10, 17, ...
TEST(Xxh64, EqualsTheReference) {
    std::string bytes;
    for (int i = 0; i < 300; ++i) {
        bytes.push_back(static_cast<char>(i * 7 + 3));
    }
    const struct {
        std::size_t size;
        std::uint64_t unseeded, seeded;
    } cases[] = {{0, 0xef46db3751d8e999, 0x7fef5b0c316777ed},
                 {1, 0x1f25c8d0bc1f4bb6, 0x1e2ea53a3040e362},
                 {3, 0x31d2363f52e564c9, 0x05c22bc4b93347d9},
                 {4, 0x9bb64b7d66ee9fda, 0x6f43828b2dc8c736},
                 {7, 0x9a7b149959ce60d8, 0x8ba3f8e8dcfc9a32},
                 {8, 0xdab99d95c6f90092, 0x311893ba9020dedf},
                 {31, 0xa2aa5f33cc4a6119, 0x2c9e9c9d631d0aaa},
                 {32, 0x23c3c17ef790fd97, 0xd1dc5d84aebdafb4},
                 {33, 0x50a7cfc7ba588784, 0x4c4db23e16391b47},
                 {63, 0x5e3e54b431c7493c, 0xa89a91242f37eb2d},
                 {101, 0xbad4d3bf033bda4c, 0xf4caaf9852f8d642},
                 {300, 0x240004dbee0ba6dc, 0x759f30907981b27e}};
    for (const auto& c : cases) {
        const std::string_view part = std::string_view(bytes).substr(0, c.size);
        EXPECT_EQ(Xxh64(part), c.unseeded) << c.size;
        EXPECT_EQ(Xxh64(part, 0x123456789abcdef0), c.seeded) << c.size;
    }
}

}  // namespace
}  // namespace relume
