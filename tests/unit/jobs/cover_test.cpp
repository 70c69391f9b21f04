#include "server/jobs/cover.h"

#include <gtest/gtest.h>

#include <numeric>

#include "server/jobs/pass.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

using Counts = std::vector<std::uint32_t>;

std::uint64_t Sum(const Counts& counts) {
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

TEST(Cover, IsOneInFourBlocksAndEachPixelOnceInFourPasses) {
    const TileRect window{0, 0, 8 * kCoverBlock, 6 * kCoverBlock};
    const Counts first(window.area(), 8), counts(window.area(), 5);
    Counts times(window.area(), 0);
    for (std::uint32_t pass = 1; pass <= 4; ++pass) {
        const Counts cover = CutCover(window, pass, first, counts);
        ASSERT_EQ(cover.size(), counts.size());
        EXPECT_EQ(Sum(cover), Sum(counts) / 4) << pass;
        for (std::size_t i = 0; i < cover.size(); ++i) {
            EXPECT_TRUE(cover[i] == 0 || cover[i] == counts[i]);
            times[i] += cover[i] > 0 ? 1 : 0;
        }
    }
    EXPECT_EQ(times, Counts(window.area(), 1));
}

TEST(Cover, IsTheSameInACrop) {
    const TileRect full{0, 0, 150, 100}, crop{37, 21, 101, 83};
    const Counts whole = CutCover(full, 2, Counts(full.area(), 1), Counts(full.area(), 3));
    const Counts part = CutCover(crop, 2, Counts(crop.area(), 1), Counts(crop.area(), 3));
    std::size_t i = 0;
    for (int y = crop.y0; y < crop.y1; ++y) {
        for (int x = crop.x0; x < crop.x1; ++x, ++i) {
            ASSERT_EQ(part[i], whole[static_cast<std::size_t>(y * 150 + x)]) << x << " " << y;
        }
    }
}

TEST(Cover, LeavesNoPixelWithoutSamples) {
    const TileRect window{0, 0, 64, 64};
    Counts counts(window.area());
    for (std::size_t i = 0; i < counts.size(); ++i) {
        counts[i] = static_cast<std::uint32_t>(i % 20);
    }
    const Counts cover = CutCover(window, 0, Counts(window.area(), 0), counts);
    for (std::size_t i = 0; i < counts.size(); ++i) {
        EXPECT_EQ(cover[i] % 2, 0u);
        EXPECT_LE(4 * cover[i], counts[i]);
        EXPECT_GT(4 * (cover[i] + 2), counts[i]);
    }
}

TEST(Cover, ThereIsNoneWhereItWouldBeNothingOrAll) {
    const TileRect small{0, 0, kCoverBlock, kCoverBlock};
    for (std::uint32_t pass = 0; pass < 4; ++pass) {
        EXPECT_TRUE(
            CutCover(small, pass, Counts(small.area(), 4), Counts(small.area(), 4)).empty());
    }
    EXPECT_TRUE(CutCover(small, 0, Counts(small.area(), 0), Counts(small.area(), 4)).empty());
}

TEST(Cover, WaitsUntilItIsOpenAndFollowsTheRest) {
    const TileRect window{0, 0, 2, 1};
    Film film(window, 2, 1);
    Pass pass(window, 8, {0, 0}, {70, 6}, {0, 2});
    ASSERT_EQ(pass.unit_count(), 3u);
    EXPECT_EQ(pass.first_cover_unit(), 2u);
    EXPECT_EQ(pass.samples_left(), 76u);
    EXPECT_EQ(pass.samples_left_but_cover(), 74u);
    const TileTask cover = pass.Task(2);
    EXPECT_EQ(cover.first, (Counts{70, 4}));
    EXPECT_EQ(cover.count, (Counts{0, 2}));
    for (const std::size_t unit : {2u, 1u, 0u}) {
        EXPECT_FALSE(pass.merged_but_cover());
        pass.Accept(unit, PseudoRender(pass.Task(unit)));
        pass.Merge(0, false, &film);
    }
    EXPECT_TRUE(pass.merged_but_cover());
    EXPECT_FALSE(pass.merged());
    EXPECT_EQ(pass.samples_left(), 0u);
    EXPECT_EQ(film.NextIndex(0), 70u);
    EXPECT_EQ(film.NextIndex(1), 4u);
    EXPECT_LT(pass.TileError(0), 0);
    pass.Merge(0, true, &film);
    EXPECT_TRUE(pass.merged());
    EXPECT_EQ(film.NextIndex(1), 6u);
    EXPECT_DOUBLE_EQ(pass.TileError(0) / 2, film.EstimateRelMSE());
}

}  // namespace
}  // namespace relume::jobs
