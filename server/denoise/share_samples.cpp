#include "server/denoise/share_samples.h"

#include <algorithm>
#include <cmath>

namespace relume::denoise {

Plane ShareSamples(const Plane& priority, double samples, double fewest, double most) {
    Plane counts(priority.size());
    const double mean = samples / static_cast<double>(std::max<std::size_t>(priority.size(), 1));
    float least = INFINITY;
    for (const float p : priority) {
        least = p > 0 ? std::min(least, p) : least;
    }
    if (!(mean > fewest && mean < most) || !std::isfinite(least)) {
        std::fill(counts.begin(), counts.end(), static_cast<float>(mean));
        return counts;
    }
    const auto count_at = [&](double scale, std::size_t i) {
        return std::clamp(scale * static_cast<double>(priority[i]), fewest, most);
    };
    const auto sum_at = [&](double scale) {
        double sum = 0;
        for (std::size_t i = 0; i < counts.size(); ++i) {
            sum += count_at(scale, i);
        }
        return sum;
    };
    // Bisection; the sum rises with the scale. At the highest, all that ask have `most`.
    double low = 0, high = most / static_cast<double>(least);
    while (high - low > 1e-9 * high) {
        const double middle = low > 0 ? 0.5 * (low + high) : high / 1024;
        (sum_at(middle) < samples ? low : high) = middle;
    }
    // Below 0 by no more than the bisection is coarse.
    const double missing =
        std::max(0.0, (samples - sum_at(high)) / static_cast<double>(counts.size()));
    for (std::size_t i = 0; i < counts.size(); ++i) {
        counts[i] = static_cast<float>(count_at(high, i) + missing);
    }
    return counts;
}

}  // namespace relume::denoise
