#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/film/film.h"
#include "core/film/tile.h"
#include "server/jobs/pixel_counts.h"

namespace relume::jobs {

// A pixel's samples of a pass are cut into layers of this many, and merged layer by layer: how sums
// are grouped depends on the plan alone, never on tiles or workers.
inline constexpr std::uint32_t kMaxSamplesPerLease = 64;

// What a pass consists of, row-major over the window.
struct PassPlan {
    PixelCounts first;   // index of each pixel's next sample
    PixelCounts counts;  // samples of each pixel
    PixelCounts cover;   // how many of its last samples are the cover; empty: none
};

// One pass, cut into units of tile x part x layer, each the matter of one lease at a time. The
// parts are what the next plan waits for and the cover (cover.h).
class Pass {
  public:
    Pass(const TileRect& window, int tile_size, std::shared_ptr<const PassPlan> plan);
    Pass(const TileRect& window, int tile_size, std::vector<std::uint32_t> first,
         std::vector<std::uint32_t> counts, std::vector<std::uint32_t> cover = {})
        : Pass(window, tile_size,
               std::make_shared<const PassPlan>(
                   PassPlan{std::move(first), std::move(counts), std::move(cover)})) {}
    // Of a new pass: the film holds the first `merged` layers of each tile already, and TileError
    // is as said. Throws kDataLoss if there are not so many.
    void Restore(const std::vector<std::uint32_t>& merged, const std::vector<double>& error);
    const std::shared_ptr<const PassPlan>& plan() const { return plan_; }

    // Units in order of issue: all tiles of layer 0, then those of layer 1, and so the cover's.
    // Units without samples do not exist.
    std::size_t unit_count() const { return units_.size(); }
    // Units from here on are the cover's.
    std::size_t first_cover_unit() const { return first_cover_unit_; }
    TileTask Task(std::size_t unit) const;
    std::uint64_t Samples(std::size_t unit) const { return units_[unit].samples; }
    std::size_t TileOf(std::size_t unit) const { return units_[unit].tile; }
    bool Done(std::size_t unit) const { return units_[unit].done; }

    // Takes the result of a unit, by `worker`, once. It waits for Merge.
    void Accept(std::size_t unit, TileResult result, const std::string& worker = {});
    // The unit's result is in the film.
    bool MergedUnit(std::size_t unit) const {
        return LayerOf(units_[unit]) < tiles_[units_[unit].tile].merged;
    }
    struct Waiting {
        TileResult result;
        std::string worker;
        std::uint64_t samples = 0;
    };
    // body(Waiting) for each result that waits.
    template <typename F>
    void ForEachWaiting(F&& body) const {
        for (const Tile& tile : tiles_) {
            for (const auto& [layer, waiting] : tile.waiting) {
                body(waiting);
            }
        }
    }
    // Merges into `film` whatever of the tile has its turn: what comes before its predecessor
    // waits, and the cover unless it is `open`. `before` is called before each layer.
    void Merge(std::size_t tile, bool open, Film* film,
               const std::function<void(bool cover, const Waiting&)>& before = {});

    std::size_t tile_count() const { return tiles_.size(); }
    std::uint32_t MergedLayers(std::size_t tile) const { return tiles_[tile].merged; }
    bool Merged(std::size_t tile) const {
        return tiles_[tile].merged == tiles_[tile].first_cover + tiles_[tile].cover_layers;
    }
    // Results of the tile wait for their turn.
    bool Waits(std::size_t tile) const { return !tiles_[tile].waiting.empty(); }
    // All of it, or all but the cover, is in the film.
    bool merged() const { return unmerged_ == 0; }
    bool merged_but_cover() const { return unmerged_but_cover_ == 0; }
    // Samples of units that are not done, without and with the cover.
    std::uint64_t samples_left_but_cover() const { return left_but_cover_; }
    std::uint64_t samples_left() const { return left_; }
    // Sum of the film's EstimateRelMSE over a tile's pixels after the pass; below 0 if the pass has
    // no samples there, or not all of them are merged.
    double TileError(std::size_t tile) const { return tiles_[tile].error; }

    std::uint64_t total_samples() const { return total_samples_; }
    std::uint64_t merged_samples() const { return merged_samples_; }
    std::uint64_t active_pixels() const { return active_pixels_; }
    // What the next pass starts from: `first` after all samples of this one.
    std::vector<std::uint32_t> NextFirst() const;

  private:
    struct Unit {
        std::uint32_t tile = 0, layer = 0;
        bool cover = false, done = false;
        std::uint64_t samples = 0;
    };
    struct Tile {
        TileRect rect;
        std::uint32_t first_cover = 0, cover_layers = 0;  // layers, the cover's behind the others
        std::uint32_t merged = 0;                         // layers in the film
        std::map<std::uint32_t, Waiting> waiting;         // by layer
        double error = -1;
    };

    template <typename F>
    void ForEachPixel(const TileRect& rect, F&& body) const;
    std::uint32_t Count(std::size_t i, bool cover) const {
        const std::uint32_t kept = plan_->cover.empty() ? 0 : plan_->cover[i];
        return cover ? kept : plan_->counts[i] - kept;
    }
    // The unit's layer among all of its tile, the cover's behind the others.
    std::uint32_t LayerOf(const Unit& unit) const {
        return unit.layer + (unit.cover ? tiles_[unit.tile].first_cover : 0);
    }
    std::uint32_t AddUnits(std::uint32_t tile, bool cover);

    TileRect window_;
    std::shared_ptr<const PassPlan> plan_;
    std::vector<Tile> tiles_;
    std::vector<Unit> units_;
    std::size_t first_cover_unit_ = 0;
    std::size_t unmerged_ = 0, unmerged_but_cover_ = 0;  // units
    std::uint64_t left_ = 0, left_but_cover_ = 0;
    std::uint64_t total_samples_ = 0, merged_samples_ = 0, active_pixels_ = 0;
};

}  // namespace relume::jobs
