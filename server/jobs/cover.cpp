#include "server/jobs/cover.h"

#include <numeric>

namespace relume::jobs {
namespace {

// Which of the four blocks of a group is the cover in pass 0.
std::uint32_t FirstInGroup(std::uint32_t x, std::uint32_t y) {
    std::uint32_t hash = x * 0x9e3779b9u + y * 0x85ebca6bu;
    hash ^= hash >> 16;
    hash *= 0x7feb352du;
    hash ^= hash >> 15;
    hash *= 0x846ca68bu;
    return hash ^ (hash >> 16);
}

}  // namespace

std::vector<std::uint32_t> CutCover(const TileRect& window, std::uint32_t pass,
                                    const std::vector<std::uint32_t>& first,
                                    const std::vector<std::uint32_t>& counts) {
    std::vector<std::uint32_t> cover(counts.size(), 0);
    std::size_t i = 0;
    for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x, ++i) {
            if (first[i] == 0) {
                cover[i] = counts[i] / 4 & ~1u;
                continue;
            }
            const auto bx = static_cast<std::uint32_t>(x / kCoverBlock),
                       by = static_cast<std::uint32_t>(y / kCoverBlock);
            if ((FirstInGroup(bx / 2, by / 2) + pass) % 4 == by % 2 * 2 + bx % 2) {
                cover[i] = counts[i];
            }
        }
    }
    const auto kept = std::accumulate(cover.begin(), cover.end(), std::uint64_t{0});
    if (kept == 0 || kept == std::accumulate(counts.begin(), counts.end(), std::uint64_t{0})) {
        return {};
    }
    return cover;
}

}  // namespace relume::jobs
