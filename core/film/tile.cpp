#include "core/film/tile.h"

#include <algorithm>
#include <numeric>

#include "core/base/check.h"

namespace relume {

std::uint64_t TileTask::TotalSamples() const {
    return std::accumulate(count.begin(), count.end(), std::uint64_t{0});
}

std::size_t TileTask::ActivePixels() const {
    return static_cast<std::size_t>(
        std::count_if(count.begin(), count.end(), [](std::uint32_t c) { return c > 0; }));
}

std::vector<TileRect> CutIntoTiles(const TileRect& window, int size) {
    RELUME_CHECK(size > 0);
    std::vector<TileRect> tiles;
    for (int y = window.y0; y < window.y1; y += size) {
        for (int x = window.x0; x < window.x1; x += size) {
            tiles.push_back({x, y, std::min(x + size, window.x1), std::min(y + size, window.y1)});
        }
    }
    return tiles;
}

}  // namespace relume
