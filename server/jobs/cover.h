#pragma once

#include <cstdint>
#include <vector>

#include "core/film/tile.h"

namespace relume::jobs {

// A pass is cut in two, so that workers have leases while the next one is planned: what the plan
// waits for, and the cover, of which the film that it sees has nothing yet. How it is cut depends
// on the plan and the place in the full image alone, never on tiles, workers or time.
//
// The cover is all samples of one in four blocks of kCoverBlock x kCoverBlock pixels: of each 2x2
// blocks one, another one in each pass. A pixel that has no sample before the pass must not be left
// without: of those, in all blocks, it is the last quarter of the samples, an even number.
inline constexpr int kCoverBlock = 16;

// Samples of each pixel that belong to the cover of pass `pass` (from 0), its last ones; empty if
// nothing, or everything, would. `first`: samples before the pass; `counts`: in it; row-major over
// the window.
std::vector<std::uint32_t> CutCover(const TileRect& window, std::uint32_t pass,
                                    const std::vector<std::uint32_t>& first,
                                    const std::vector<std::uint32_t>& counts);

}  // namespace relume::jobs
