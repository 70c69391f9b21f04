#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/film/film.h"
#include "core/film/tile.h"

namespace relume::jobs {

// A copy of a film as of one moment, made tile by tile while the film goes on: whoever is about to
// change a tile takes it first. Every tile is handed on once, in no order. Not thread-safe.
class FilmCopy {
  public:
    // Gets Film::SaveTile of each tile of CutIntoTiles.
    using Sink = std::function<void(std::size_t tile, std::string bytes)>;

    FilmCopy(const TileRect& window, int tile_size, Sink sink)
        : tiles_(CutIntoTiles(window, tile_size)),
          taken_(tiles_.size(), false),
          sink_(std::move(sink)) {}

    void Take(const Film& film, std::size_t tile) {
        if (!taken_[tile]) {
            taken_[tile] = true;
            sink_(tile, film.SaveTile(tiles_[tile]));
        }
    }
    // False if all tiles are taken.
    bool TakeNext(const Film& film) {
        while (next_ < tiles_.size() && taken_[next_]) {
            ++next_;
        }
        if (next_ == tiles_.size()) {
            return false;
        }
        Take(film, next_);
        return true;
    }

  private:
    std::vector<TileRect> tiles_;
    std::vector<bool> taken_;
    std::size_t next_ = 0;
    Sink sink_;
};

}  // namespace relume::jobs
