#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "core/film/film.h"
#include "core/film/tile.h"

namespace relume::jobs {

// A pixel's samples of a pass are cut into layers of this many, and merged layer by layer: how sums
// are grouped depends on the plan alone, never on tiles or workers.
inline constexpr std::uint32_t kMaxSamplesPerLease = 64;

// One pass, cut into units of tile x layer, each the matter of one lease at a time.
class Pass {
  public:
    // `counts`: samples for each pixel of the window, row-major. `first`: index of each pixel's
    // next sample.
    Pass(const TileRect& window, int tile_size, std::vector<std::uint32_t> first,
         std::vector<std::uint32_t> counts);

    // Units in order of issue: all tiles of layer 0, then those of layer 1. Units without samples
    // do not exist.
    std::size_t unit_count() const { return units_.size(); }
    TileTask Task(std::size_t unit) const;
    std::uint64_t Samples(std::size_t unit) const { return units_[unit].samples; }
    bool Done(std::size_t unit) const { return units_[unit].done; }

    // Takes the result of a unit, once, and merges into `film` whatever of the tile has its turn: a
    // layer that comes before its predecessor waits.
    void Accept(std::size_t unit, TileResult result, Film* film);

    bool complete() const { return done_ == units_.size(); }
    std::uint64_t total_samples() const { return total_samples_; }
    std::uint64_t active_pixels() const { return active_pixels_; }
    // What the next pass starts from: `first` after all samples of this one.
    std::vector<std::uint32_t> NextFirst() const;

  private:
    struct Unit {
        std::uint32_t tile = 0, layer = 0;
        std::uint64_t samples = 0;
        bool done = false;
    };
    struct Tile {
        TileRect rect;
        std::uint32_t merged = 0;                     // layers in the film
        std::map<std::uint32_t, TileResult> waiting;  // by layer
    };

    template <typename F>
    void ForEachPixel(const TileRect& rect, F&& body) const;

    TileRect window_;
    std::vector<std::uint32_t> first_, counts_;
    std::vector<Tile> tiles_;
    std::vector<Unit> units_;
    std::size_t done_ = 0;
    std::uint64_t total_samples_ = 0, active_pixels_ = 0;
};

}  // namespace relume::jobs
