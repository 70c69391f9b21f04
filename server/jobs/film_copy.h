#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/film/film.h"
#include "core/film/tile.h"
#include "server/jobs/checkpoint.h"
#include "server/jobs/pass.h"

namespace relume::jobs {

// A copy of a film made tile by tile while the film goes on, and the checkpoint that belongs to it.
// Each tile is copied as it is when its turn comes, with as many layers merged as it has by then:
// the checkpoint follows. Only what was planned after the copy began, or could not be merged then,
// must not be in it: whoever is about to merge such a thing has the tile taken first. Not
// thread-safe.
class FilmCopy {
  public:
    // Gets Film::SaveTile of each tile of CutIntoTiles, once, in no order.
    using Sink = std::function<void(std::size_t tile, std::string bytes)>;

    // `passes`: those open in `checkpoint`, which is as of now.
    FilmCopy(Checkpoint checkpoint, std::vector<std::shared_ptr<const Pass>> passes, Sink sink);

    // To be called before the layer is merged into the tile.
    void Merging(const Pass& pass, std::size_t tile, bool cover, const Pass::Waiting& layer,
                 const Film& film);
    // False if all tiles are taken.
    bool TakeNext(const Film& film);

    // As of the tiles taken so far, and as of the beginning for all others.
    const Checkpoint& checkpoint() const { return checkpoint_; }
    Checkpoint TakeCheckpoint() { return std::move(checkpoint_); }

  private:
    void Take(const Film& film, std::size_t tile);

    Checkpoint checkpoint_;
    std::vector<std::shared_ptr<const Pass>> passes_;
    std::vector<TileRect> tiles_;
    std::vector<bool> taken_;
    std::size_t next_ = 0;
    Sink sink_;
};

}  // namespace relume::jobs
