#include "core/film/tile.h"

#include <gtest/gtest.h>

#include <map>
#include <utility>

namespace relume {
namespace {

TEST(Tiles, CoverTheWindowOnce) {
    const TileRect window{5, -3, 42, 28};
    for (const int size : {1, 7, 16, 32, 64}) {
        std::map<std::pair<int, int>, int> covered;
        for (const TileRect& tile : CutIntoTiles(window, size)) {
            EXPECT_FALSE(tile.empty());
            EXPECT_TRUE(window.Contains(tile));
            EXPECT_LE(tile.width(), size);
            EXPECT_LE(tile.height(), size);
            for (int y = tile.y0; y < tile.y1; ++y) {
                for (int x = tile.x0; x < tile.x1; ++x) {
                    ++covered[{x, y}];
                }
            }
        }
        EXPECT_EQ(covered.size(), window.area());
        for (const auto& [pixel, times] : covered) {
            EXPECT_EQ(times, 1);
        }
    }
}

TEST(Tiles, AreInRowMajorOrder) {
    const auto tiles = CutIntoTiles({0, 0, 3, 3}, 2);
    ASSERT_EQ(tiles.size(), 4u);
    EXPECT_EQ(tiles[0], (TileRect{0, 0, 2, 2}));
    EXPECT_EQ(tiles[1], (TileRect{2, 0, 3, 2}));
    EXPECT_EQ(tiles[2], (TileRect{0, 2, 2, 3}));
    EXPECT_EQ(tiles[3], (TileRect{2, 2, 3, 3}));
    EXPECT_TRUE(CutIntoTiles({4, 4, 4, 9}, 2).empty());
}

TEST(TileTask, CountsSamplesAndActivePixels) {
    const TileTask task{{0, 0, 2, 2}, {0, 4, 8, 0}, {3, 0, 4'000'000'000u, 2'000'000'000u}};
    EXPECT_EQ(task.TotalSamples(), 6'000'000'003u);
    EXPECT_EQ(task.ActivePixels(), 3u);
}

}  // namespace
}  // namespace relume
