#include "worker/render/sampler/sampler.h"

#include <gtest/gtest.h>

#include <set>

namespace relume::render {
namespace {

TEST(Sampler, EachHalfIsANetInEachDimension) {
    // The first 2^m points: one in each of the boxes of 2^-k by 2^-(m-k), whatever k. So it is from
    // any start that is a multiple of 2^m.
    for (const std::uint32_t half : {0u, 1u}) {
        for (const std::uint32_t dimension : {0u, 1u, 7u, 100u}) {
            for (const int m : {1, 3, 4, 6, 8}) {
                const std::uint32_t size = 1u << m;
                for (const std::uint32_t start : {0u, 5 * size}) {
                    for (int k = 0; k <= m; ++k) {
                        std::set<int> boxes;
                        for (std::uint32_t i = start; i < start + size; ++i) {
                            const Vec2f p = Sampler(3, 11, 5, 2 * i + half).Pair(dimension);
                            boxes.insert(static_cast<int>(p.x * static_cast<float>(1 << k)) *
                                             (1 << (m - k)) +
                                         static_cast<int>(p.y * static_cast<float>(1 << (m - k))));
                        }
                        EXPECT_EQ(boxes.size(), size) << dimension << " " << m << " " << k;
                    }
                }
            }
        }
    }
}

TEST(Sampler, OneIsStratified) {
    std::set<int> strata;
    for (std::uint32_t i = 0; i < 64; ++i) {
        strata.insert(static_cast<int>(Sampler(3, 11, 5, 2 * i).One(9) * 64));
    }
    EXPECT_EQ(strata.size(), 64u);
}

TEST(Sampler, NumbersAreInTheHalfOpenUnitInterval) {
    for (std::uint32_t i = 0; i < 100000; ++i) {
        const Vec2f p = Sampler(i, 1, 2, i).Pair(i);
        ASSERT_TRUE(p.x >= 0 && p.x < 1 && p.y >= 0 && p.y < 1);
    }
    EXPECT_LT(ToUnit(0xffffffffu), 1.0f);
}

TEST(Sampler, SeedPixelIndexAndDimensionAllMatter) {
    const float base = Sampler(1, 2, 3, 4).One(5);
    EXPECT_EQ(base, Sampler(1, 2, 3, 4).One(5));
    EXPECT_NE(base, Sampler(2, 2, 3, 4).One(5));
    EXPECT_NE(base, Sampler(1, 3, 3, 4).One(5));
    EXPECT_NE(base, Sampler(1, 2, 4, 4).One(5));
    EXPECT_NE(base, Sampler(1, 3, 2, 4).One(5));
    EXPECT_NE(base, Sampler(1, 2, 3, 5).One(5));
    EXPECT_NE(base, Sampler(1, 2, 3, 6).One(5));
    EXPECT_NE(base, Sampler(1, 2, 3, 4).One(6));
}

}  // namespace
}  // namespace relume::render
