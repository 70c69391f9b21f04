#include "server/jobs/pass.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

constexpr TileRect kWindow{3, 5, 40, 30};

std::vector<std::uint32_t> Counts() {
    std::vector<std::uint32_t> counts(kWindow.area());
    for (std::size_t i = 0; i < counts.size(); ++i) {
        counts[i] = i % 7 == 0 ? 0 : static_cast<std::uint32_t>(i * 37 % 150);
    }
    return counts;
}

std::vector<std::uint32_t> Firsts() {
    std::vector<std::uint32_t> first(kWindow.area());
    std::iota(first.begin(), first.end(), 0u);
    return first;
}

bool SameBits(const Film& a, const Film& b) {
    for (int c = 0; c < kFilmChannelCount; ++c) {
        if (!std::ranges::equal(a.Plane(c), b.Plane(c))) {
            return false;
        }
    }
    return true;
}

Film RunInOrder(int tile_size, std::uint32_t shuffle_seed) {
    Film film(kWindow, 64, 64);
    Pass pass(kWindow, tile_size, std::vector<std::uint32_t>(kWindow.area(), 0), Counts());
    std::vector<std::size_t> order(pass.unit_count());
    std::iota(order.begin(), order.end(), 0u);
    std::mt19937 random(shuffle_seed);
    if (shuffle_seed != 0) {
        std::shuffle(order.begin(), order.end(), random);
    }
    for (const std::size_t unit : order) {
        EXPECT_FALSE(pass.merged());
        pass.Accept(unit, PseudoRender(pass.Task(unit)));
        pass.Merge(pass.TileOf(unit), true, &film);
    }
    EXPECT_TRUE(pass.merged());
    return film;
}

TEST(Pass, UnitsCoverEverySampleOnceAndNoneBeyondTheLimit) {
    const auto counts = Counts(), first = Firsts();
    for (const int tile_size : {8, 16, 64}) {
        const Pass pass(kWindow, tile_size, first, counts);
        std::vector<std::uint32_t> next = first;  // where each pixel's next unit must begin
        std::uint64_t total = 0;
        for (std::size_t unit = 0; unit < pass.unit_count(); ++unit) {
            const TileTask task = pass.Task(unit);
            EXPECT_EQ(task.TotalSamples(), pass.Samples(unit));
            EXPECT_GT(pass.Samples(unit), 0u);
            EXPECT_LE(std::max(task.rect.width(), task.rect.height()), tile_size);
            total += task.TotalSamples();
            for (std::size_t i = 0; i < task.count.size(); ++i) {
                const int x = task.rect.x0 + static_cast<int>(i) % task.rect.width() - kWindow.x0;
                const int y = task.rect.y0 + static_cast<int>(i) / task.rect.width() - kWindow.y0;
                const auto p = static_cast<std::size_t>(y * kWindow.width() + x);
                EXPECT_LE(task.count[i], kMaxSamplesPerLease);
                if (task.count[i] > 0) {
                    EXPECT_EQ(task.first[i], next[p]);
                    next[p] += task.count[i];
                }
            }
        }
        EXPECT_EQ(next, pass.NextFirst());
        EXPECT_EQ(total, pass.total_samples());
        EXPECT_EQ(total, std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}));
        EXPECT_EQ(pass.active_pixels(), static_cast<std::uint64_t>(std::ranges::count_if(
                                            counts, [](auto c) { return c > 0; })));
    }
}

TEST(Pass, FilmBitsDependNeitherOnTilesNorOnOrder) {
    const Film film = RunInOrder(32, 0);
    EXPECT_GT(film.TotalBadSamples(), 0);
    for (const int tile_size : {8, 16, 32, 64}) {
        for (const std::uint32_t seed : {0u, 1u, 2u}) {
            EXPECT_TRUE(SameBits(RunInOrder(tile_size, seed), film)) << tile_size << " " << seed;
        }
    }
}

TEST(Pass, ALayerWaitsForItsPredecessor) {
    const TileRect window{0, 0, 1, 1};
    Film film(window, 1, 1);
    Pass pass(window, 8, {0}, {130});
    ASSERT_EQ(pass.unit_count(), 3u);
    pass.Accept(2, PseudoRender(pass.Task(2)));
    pass.Merge(0, true, &film);
    EXPECT_EQ(film.NextIndex(0), 0u);
    pass.Accept(0, PseudoRender(pass.Task(0)));
    pass.Merge(0, true, &film);
    EXPECT_EQ(film.NextIndex(0), 64u);
    pass.Accept(1, PseudoRender(pass.Task(1)));
    pass.Merge(0, true, &film);
    EXPECT_EQ(film.NextIndex(0), 130u);
    EXPECT_TRUE(pass.merged());
}

}  // namespace
}  // namespace relume::jobs
