#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace relume::jobs {

// New samples of each pixel, `budget` in all (one less if it is odd), in pairs: in proportion to
// the deviation, counting those that are planned already (Neyman 1934), but at most three times as
// many as those. `salt` chooses which pixels get the odd pair. All 0 if no pixel has any deviation.
std::vector<std::uint32_t> ShareByDeviation(std::span<const std::uint32_t> planned,
                                            const std::vector<float>& deviation,
                                            std::uint64_t budget, std::uint32_t salt);

}  // namespace relume::jobs
