#include "server/jobs/spread.h"

#include <algorithm>
#include <numeric>

namespace relume::jobs {
namespace {

// Pixel i is number i * step mod n in a scattered order: a golden-section lattice.
std::uint64_t LatticeStep(std::uint64_t n) {
    auto step = std::max<std::uint64_t>(
        1, static_cast<std::uint64_t>(static_cast<double>(n) * 0.6180339887498949));
    while (std::gcd(step, n) != 1) {
        ++step;
    }
    return step;
}

}  // namespace

std::vector<std::uint32_t> SpreadEvenly(std::size_t pixels, std::uint64_t samples,
                                        std::uint32_t pack) {
    std::vector<std::uint32_t> counts(pixels, 0);
    if (pixels == 0) {
        return counts;
    }
    const std::uint64_t n = pixels;
    const std::uint64_t packs = samples / pack;
    const std::uint64_t all = packs / n, some = packs % n;
    const std::uint64_t step = LatticeStep(n);
    for (std::uint64_t i = 0; i < n; ++i) {
        counts[i] = static_cast<std::uint32_t>(pack * (all + (i * step % n < some ? 1 : 0)));
    }
    return counts;
}

void ScaleDown(std::uint64_t samples, std::vector<std::uint32_t>* counts) {
    const std::uint64_t n = counts->size();
    const std::uint64_t total = std::accumulate(counts->begin(), counts->end(), std::uint64_t{0});
    if (total <= samples) {
        return;
    }
    const std::uint64_t step = LatticeStep(n);
    struct Rest {
        std::uint64_t part, rank;  // of `total`; in the scattered order
        std::uint64_t pixel;
    };
    std::vector<Rest> rests;
    std::uint64_t left = samples;
    for (std::uint64_t i = 0; i < n; ++i) {
        const std::uint64_t wanted = (*counts)[i] * samples;
        (*counts)[i] = static_cast<std::uint32_t>(wanted / total);
        left -= (*counts)[i];
        if (wanted % total != 0) {
            rests.push_back({wanted % total, i * step % n, i});
        }
    }
    const auto end = rests.begin() + static_cast<std::ptrdiff_t>(left);
    std::nth_element(rests.begin(), end, rests.end(), [](const Rest& a, const Rest& b) {
        return a.part != b.part ? a.part > b.part : a.rank < b.rank;
    });
    for (auto it = rests.begin(); it != end; ++it) {
        ++(*counts)[it->pixel];
    }
}

std::vector<std::uint32_t> SpreadPilot(std::size_t pixels, std::uint32_t spp,
                                       std::uint64_t budget) {
    const std::uint64_t samples = std::min<std::uint64_t>(std::uint64_t{spp} * pixels, budget);
    if (samples == std::uint64_t{spp} * pixels) {
        return std::vector<std::uint32_t>(pixels, spp);
    }
    return SpreadEvenly(pixels, samples, samples < 2 * std::uint64_t{pixels} ? 1 : 2);
}

std::vector<std::uint32_t> RoundToPairs(std::size_t pixels,
                                        const std::function<double(std::size_t)>& expected,
                                        std::uint64_t samples, std::uint32_t salt) {
    std::vector<std::uint32_t> counts(pixels);
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
        std::uint32_t hash = static_cast<std::uint32_t>(i) * 0x9e3779b9u + salt * 0x85ebca6bu;
        hash ^= hash >> 16;
        hash *= 0x7feb352du;
        hash ^= hash >> 15;
        hash *= 0x846ca68bu;
        hash ^= hash >> 16;
        counts[i] = 2 * static_cast<std::uint32_t>(0.5 * expected(i) + hash * 0x1p-32);
        sum += counts[i];
    }
    if (sum > samples) {
        ScaleDown(samples, &counts);
    } else if (sum > 0) {
        const std::vector<std::uint32_t> rest = SpreadEvenly(pixels, samples - sum, 2);
        for (std::size_t i = 0; i < pixels; ++i) {
            counts[i] += rest[i];
        }
    }
    return counts;
}

}  // namespace relume::jobs
