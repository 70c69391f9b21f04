#pragma once

#include "core/film/tile.h"

namespace relume::jobs {

// Throws kInvalidArgument, naming pixel and plane, unless `result` can be the answer to `task`: the
// task's active pixels, kFilmChannelCount values each, all finite, the counts of the halves as the
// sample indices have them, no negative sum of squares;
// its samples, if the task is to keep them.
void CheckResult(const TileTask& task, const TileResult& result);

}  // namespace relume::jobs
