#include "server/jobs/spread.h"

#include <algorithm>
#include <numeric>

namespace relume::jobs {

std::vector<std::uint32_t> SpreadEvenly(std::size_t pixels, std::uint64_t samples,
                                        std::uint32_t pack) {
    std::vector<std::uint32_t> counts(pixels, 0);
    if (pixels == 0) {
        return counts;
    }
    const std::uint64_t n = pixels;
    const std::uint64_t packs = samples / pack;
    const std::uint64_t all = packs / n, some = packs % n;
    // Pixel i is number i * step mod n in a scattered order: a golden-section lattice.
    auto step = std::max<std::uint64_t>(
        1, static_cast<std::uint64_t>(static_cast<double>(n) * 0.6180339887498949));
    while (std::gcd(step, n) != 1) {
        ++step;
    }
    for (std::uint64_t i = 0; i < n; ++i) {
        counts[i] = static_cast<std::uint32_t>(pack * (all + (i * step % n < some ? 1 : 0)));
    }
    return counts;
}

std::vector<std::uint32_t> SpreadPilot(std::size_t pixels, std::uint32_t spp,
                                       std::uint64_t budget) {
    const std::uint64_t samples = std::min<std::uint64_t>(std::uint64_t{spp} * pixels, budget);
    if (samples == std::uint64_t{spp} * pixels) {
        return std::vector<std::uint32_t>(pixels, spp);
    }
    return SpreadEvenly(pixels, samples, samples < 2 * std::uint64_t{pixels} ? 1 : 2);
}

}  // namespace relume::jobs
