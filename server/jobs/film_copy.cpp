#include "server/jobs/film_copy.h"

#include <algorithm>

#include "server/jobs/count_answer.h"

namespace relume::jobs {

FilmCopy::FilmCopy(Checkpoint checkpoint, std::vector<std::shared_ptr<const Pass>> passes,
                   Sink sink)
    : checkpoint_(std::move(checkpoint)),
      passes_(std::move(passes)),
      tiles_(CutIntoTiles(checkpoint_.window, checkpoint_.tile_size)),
      taken_(tiles_.size(), false),
      sink_(std::move(sink)) {}

void FilmCopy::Merging(const Pass& pass, std::size_t tile, bool cover, const Pass::Waiting& layer,
                       const Film& film) {
    if (taken_[tile]) {
        return;
    }
    const auto it = std::ranges::find_if(passes_, [&](const auto& p) { return p.get() == &pass; });
    const bool newest = it != passes_.end() && it + 1 == passes_.end();
    if (it == passes_.end() || (cover && newest && !checkpoint_.stop)) {
        Take(film, tile);
        return;
    }
    OpenPassState& state = checkpoint_.open[static_cast<std::size_t>(it - passes_.begin())];
    state.merged_samples += layer.samples;
    CountAnswer(layer.worker, layer.samples, layer.result, 1, &checkpoint_.info);
}

bool FilmCopy::TakeNext(const Film& film) {
    while (next_ < tiles_.size() && taken_[next_]) {
        ++next_;
    }
    if (next_ == tiles_.size()) {
        return false;
    }
    Take(film, next_);
    return true;
}

void FilmCopy::Take(const Film& film, std::size_t tile) {
    taken_[tile] = true;
    for (std::size_t i = 0; i < passes_.size(); ++i) {
        checkpoint_.open[i].merged[tile] = passes_[i]->MergedLayers(tile);
        checkpoint_.open[i].error[tile] = passes_[i]->TileError(tile);
    }
    sink_(tile, film.SaveTile(tiles_[tile]));
}

}  // namespace relume::jobs
