#include "server/jobs/pass.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"

namespace relume::jobs {
namespace {

std::uint32_t LayerCount(std::uint32_t count, std::uint32_t layer) {
    const std::uint64_t begin = std::uint64_t{layer} * kMaxSamplesPerLease;
    return count > begin ? static_cast<std::uint32_t>(
                               std::min<std::uint64_t>(count - begin, kMaxSamplesPerLease))
                         : 0;
}

}  // namespace

// body(index in the window) for each pixel of rect, row-major.
template <typename F>
void Pass::ForEachPixel(const TileRect& rect, F&& body) const {
    for (int y = rect.y0; y < rect.y1; ++y) {
        for (int x = rect.x0; x < rect.x1; ++x) {
            body(static_cast<std::size_t>(y - window_.y0) *
                     static_cast<std::size_t>(window_.width()) +
                 static_cast<std::size_t>(x - window_.x0));
        }
    }
}

Pass::Pass(const TileRect& window, int tile_size, std::vector<std::uint32_t> first,
           std::vector<std::uint32_t> counts)
    : window_(window), first_(std::move(first)), counts_(std::move(counts)) {
    RELUME_CHECK_EQ(counts_.size(), window.area());
    RELUME_CHECK_EQ(first_.size(), window.area());
    for (const TileRect& rect : CutIntoTiles(window, tile_size)) {
        tiles_.push_back({rect, 0, {}});
    }
    for (std::uint32_t t = 0; t < tiles_.size(); ++t) {
        std::vector<std::uint64_t> layers;
        ForEachPixel(tiles_[t].rect, [&](std::size_t i) {
            if (counts_[i] == 0) {
                return;
            }
            ++active_pixels_;
            total_samples_ += counts_[i];
            const std::size_t needed = (counts_[i] + kMaxSamplesPerLease - 1) / kMaxSamplesPerLease;
            if (layers.size() < needed) {
                layers.resize(needed, 0);
            }
            for (std::size_t layer = 0; layer < needed; ++layer) {
                layers[layer] += LayerCount(counts_[i], static_cast<std::uint32_t>(layer));
            }
        });
        for (std::uint32_t layer = 0; layer < layers.size(); ++layer) {
            units_.push_back({t, layer, layers[layer], false});
        }
    }
    std::stable_sort(units_.begin(), units_.end(),
                     [](const Unit& a, const Unit& b) { return a.layer < b.layer; });
}

TileTask Pass::Task(std::size_t unit) const {
    const auto& [t, layer, samples, done] = units_[unit];
    TileTask task;
    task.rect = tiles_[t].rect;
    task.first.reserve(task.rect.area());
    task.count.reserve(task.rect.area());
    ForEachPixel(task.rect, [&, l = layer](std::size_t i) {
        task.first.push_back(first_[i] + l * kMaxSamplesPerLease);
        task.count.push_back(LayerCount(counts_[i], l));
    });
    return task;
}

void Pass::Accept(std::size_t unit, TileResult result, Film* film) {
    RELUME_CHECK(!units_[unit].done);
    units_[unit].done = true;
    ++done_;
    Tile& tile = tiles_[units_[unit].tile];
    tile.waiting.emplace(units_[unit].layer, std::move(result));
    while (!tile.waiting.empty() && tile.waiting.begin()->first == tile.merged) {
        film->Merge(tile.waiting.begin()->second);
        tile.waiting.erase(tile.waiting.begin());
        ++tile.merged;
    }
}

std::vector<std::uint32_t> Pass::NextFirst() const {
    std::vector<std::uint32_t> next(first_);
    for (std::size_t i = 0; i < next.size(); ++i) {
        next[i] += counts_[i];
    }
    return next;
}

}  // namespace relume::jobs
