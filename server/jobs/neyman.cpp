#include "server/jobs/neyman.h"

#include <algorithm>

#include "server/jobs/spread.h"

namespace relume::jobs {

std::vector<std::uint32_t> ShareByDeviation(std::span<const std::uint32_t> planned,
                                            const std::vector<float>& deviation,
                                            std::uint64_t budget, std::uint32_t salt) {
    const std::size_t pixels = planned.size();
    // A pixel of deviation s gets lambda s - n, at least 0 and at most 3 n: lambda by bisection.
    const auto wish = [&](std::size_t i, double lambda) {
        const double n = planned[i];
        return std::clamp(lambda * static_cast<double>(deviation[i]) - n, 0.0, 3 * n);
    };
    double low = 0, high = 1;
    const auto total = [&](double lambda) {
        double sum = 0;
        for (std::size_t i = 0; i < pixels; ++i) {
            sum += wish(i, lambda);
        }
        return sum;
    };
    const double target = static_cast<double>(budget);
    while (total(high) < target && high < 1e30) {
        high *= 2;
    }
    for (int step = 0; step < 40; ++step) {
        const double middle = 0.5 * (low + high);
        (total(middle) < target ? low : high) = middle;
    }
    std::vector<std::uint32_t> counts(pixels);
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
        // Pairs, rounded up or down by a number of the pixel's own.
        std::uint32_t hash = static_cast<std::uint32_t>(i) * 0x9e3779b9u + salt * 0x85ebca6bu;
        hash ^= hash >> 16;
        hash *= 0x7feb352du;
        hash ^= hash >> 15;
        hash *= 0x846ca68bu;
        hash ^= hash >> 16;
        const double pairs = 0.5 * wish(i, low) + hash * 0x1p-32;
        counts[i] = 2 * static_cast<std::uint32_t>(pairs);
        sum += counts[i];
    }
    if (sum > budget) {
        ScaleDown(budget, &counts);
    } else if (sum > 0) {
        const std::vector<std::uint32_t> rest = SpreadEvenly(pixels, budget - sum, 2);
        for (std::size_t i = 0; i < pixels; ++i) {
            counts[i] += rest[i];
        }
    }
    return counts;
}

}  // namespace relume::jobs
