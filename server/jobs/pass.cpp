#include "server/jobs/pass.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "core/base/check.h"
#include "core/base/error.h"

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

Pass::Pass(const TileRect& window, int tile_size, std::shared_ptr<const PassPlan> plan)
    : window_(window), plan_(std::move(plan)) {
    RELUME_CHECK_EQ(plan_->counts.size(), window.area());
    RELUME_CHECK_EQ(plan_->first.size(), window.area());
    RELUME_CHECK(plan_->cover.empty() || plan_->cover.size() == window.area());
    for (const TileRect& rect : CutIntoTiles(window, tile_size)) {
        tiles_.emplace_back().rect = rect;
    }
    for (std::uint32_t t = 0; t < tiles_.size(); ++t) {
        ForEachPixel(tiles_[t].rect, [&](std::size_t i) {
            active_pixels_ += plan_->counts[i] > 0 ? 1 : 0;
            total_samples_ += plan_->counts[i];
        });
        tiles_[t].first_cover = AddUnits(t, false);
        tiles_[t].cover_layers = plan_->cover.empty() ? 0 : AddUnits(t, true);
    }
    std::stable_sort(units_.begin(), units_.end(), [](const Unit& a, const Unit& b) {
        return std::tuple(a.cover, a.layer) < std::tuple(b.cover, b.layer);
    });
    first_cover_unit_ =
        static_cast<std::size_t>(std::ranges::find_if(units_, &Unit::cover) - units_.begin());
    unmerged_ = units_.size();
    unmerged_but_cover_ = first_cover_unit_;
    for (const Unit& unit : units_) {
        left_ += unit.samples;
        left_but_cover_ += unit.cover ? 0 : unit.samples;
    }
}

// The units of one part of a tile; how many.
std::uint32_t Pass::AddUnits(std::uint32_t tile, bool cover) {
    // For each number of whole layers the pixels that have so many, and the samples beyond them.
    std::vector<std::uint64_t> pixels, rest;
    ForEachPixel(tiles_[tile].rect, [&](std::size_t i) {
        const std::uint32_t count = Count(i, cover);
        const std::size_t whole = count / kMaxSamplesPerLease;
        if (pixels.size() <= whole) {
            pixels.resize(whole + 1, 0);
            rest.resize(whole + 1, 0);
        }
        ++pixels[whole];
        rest[whole] += count % kMaxSamplesPerLease;
    });
    std::vector<std::uint64_t> layers(pixels.size());
    std::uint64_t reach = 0;  // pixels with more whole layers than this one's number
    for (std::size_t layer = pixels.size(); layer-- > 0;) {
        layers[layer] = reach * kMaxSamplesPerLease + rest[layer];
        reach += pixels[layer];
    }
    if (layers.back() == 0) {
        layers.pop_back();
    }
    for (std::uint32_t layer = 0; layer < layers.size(); ++layer) {
        units_.push_back({tile, layer, cover, false, layers[layer]});
    }
    return static_cast<std::uint32_t>(layers.size());
}

TileTask Pass::Task(std::size_t unit) const {
    const Unit& u = units_[unit];
    TileTask task;
    task.rect = tiles_[u.tile].rect;
    task.first.reserve(task.rect.area());
    task.count.reserve(task.rect.area());
    ForEachPixel(task.rect, [&](std::size_t i) {
        const std::uint32_t before = u.cover ? Count(i, false) : 0;
        task.first.push_back(plan_->first[i] + before + u.layer * kMaxSamplesPerLease);
        task.count.push_back(LayerCount(Count(i, u.cover), u.layer));
    });
    return task;
}

void Pass::Restore(const std::vector<std::uint32_t>& merged, const std::vector<double>& error) {
    bool fits = merged.size() == tiles_.size() && error.size() == tiles_.size();
    for (std::size_t t = 0; fits && t < tiles_.size(); ++t) {
        RELUME_CHECK(tiles_[t].merged == 0 && tiles_[t].waiting.empty());
        fits = merged[t] <= tiles_[t].first_cover + tiles_[t].cover_layers;
        tiles_[t].merged = merged[t];
        tiles_[t].error = error[t];
    }
    if (!fits) {
        throw Error(ErrorCode::kDataLoss, "a saved pass does not fit its plan");
    }
    for (Unit& unit : units_) {
        if (LayerOf(unit) < tiles_[unit.tile].merged) {
            unit.done = true;
            merged_samples_ += unit.samples;
            left_ -= unit.samples;
            left_but_cover_ -= unit.cover ? 0 : unit.samples;
            --unmerged_;
            unmerged_but_cover_ -= unit.cover ? 0 : 1;
        }
    }
}

void Pass::Accept(std::size_t unit, TileResult result, const std::string& worker) {
    Unit& u = units_[unit];
    RELUME_CHECK(!u.done);
    u.done = true;
    left_ -= u.samples;
    left_but_cover_ -= u.cover ? 0 : u.samples;
    tiles_[u.tile].waiting.emplace(LayerOf(u), Waiting{std::move(result), worker, u.samples});
}

void Pass::Merge(std::size_t index, bool open, Film* film,
                 const std::function<void(bool cover, const Waiting&)>& before) {
    Tile& tile = tiles_[index];
    while (!tile.waiting.empty() && tile.waiting.begin()->first == tile.merged &&
           (open || tile.merged < tile.first_cover)) {
        const Waiting& next = tile.waiting.begin()->second;
        if (before) {
            before(tile.merged >= tile.first_cover, next);
        }
        film->Merge(next.result);
        merged_samples_ += next.samples;
        tile.waiting.erase(tile.waiting.begin());
        --unmerged_;
        unmerged_but_cover_ -= tile.merged < tile.first_cover ? 1 : 0;
        ++tile.merged;
        if (Merged(index)) {
            tile.error = 0;
            ForEachPixel(tile.rect, [&](std::size_t i) { tile.error += film->EstimateRelMSE(i); });
        }
    }
}

std::vector<std::uint32_t> Pass::NextFirst() const {
    std::vector<std::uint32_t> next(plan_->first.size());
    for (std::size_t i = 0; i < next.size(); ++i) {
        next[i] = plan_->first[i] + plan_->counts[i];
    }
    return next;
}

}  // namespace relume::jobs
