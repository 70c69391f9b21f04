#include "server/jobs/neyman.h"

#include <algorithm>
#include <cmath>

#include "core/base/clones.h"
#include "server/jobs/spread.h"

namespace relume::jobs {

namespace {

constexpr std::size_t kLanes = 16;
constexpr double kMostOfWhatItHas = 3;

// What a pixel of deviation s gets at lambda: lambda s - n, at least 0 and at most 3 n.
inline double Wish(std::uint32_t planned, float deviation, double lambda) {
    const double n = planned;
    return std::clamp(lambda * static_cast<double>(deviation) - n, 0.0, kMostOfWhatItHas * n);
}

struct Sums {
    double total = 0, slope = 0;  // of all wishes, and by lambda
};

// In kLanes sums, put together in the end, so that their order is the same for any width of
// vectors.
RELUME_CLONES Sums SumWishes(const std::uint32_t* planned, const float* deviation,
                             std::size_t pixels, double lambda) {
    double total[kLanes] = {}, slope[kLanes] = {};
    const auto add = [&](std::size_t i, std::size_t lane) {
        const double n = planned[i], s = deviation[i];
        const double more = lambda * s - n, most = kMostOfWhatItHas * n;
        const double wish = more < most ? more : most;
        total[lane] += wish > 0 ? wish : 0;
        slope[lane] += more > 0 && more < most ? s : 0;
    };
    std::size_t i = 0;
    for (; i + kLanes <= pixels; i += kLanes) {
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            add(i + lane, lane);
        }
    }
    for (; i < pixels; ++i) {
        add(i, 0);
    }
    Sums sums;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        sums.total += total[lane];
        sums.slope += slope[lane];
    }
    return sums;
}

// The lambda whose wishes sum to `budget`, or nearly: Newton's method, kept between bounds. Very
// large if they can't.
double FindLambda(std::span<const std::uint32_t> planned, const std::vector<float>& deviation,
                  double budget) {
    const auto sums = [&](double lambda) {
        return SumWishes(planned.data(), deviation.data(), planned.size(), lambda);
    };
    constexpr double kLargest = 1e30;
    if (sums(kLargest).total <= budget) {
        return kLargest;
    }
    double low = 0, high = kLargest, lambda = 1;
    for (int step = 0; step < 200; ++step) {
        const Sums at = sums(lambda);
        if (std::abs(at.total - budget) < 0.5) {
            break;
        }
        (at.total < budget ? low : high) = lambda;
        const double next = lambda + (budget - at.total) / at.slope;
        if (at.slope > 0 && next > low && next < high) {
            lambda = next;
        } else if (high == kLargest) {
            lambda *= 2;
        } else {
            lambda = low > 0 ? 0.5 * (low + high) : 0.5 * high;
        }
    }
    return lambda;
}

}  // namespace

std::vector<std::uint32_t> ShareByDeviation(std::span<const std::uint32_t> planned,
                                            const std::vector<float>& deviation,
                                            std::uint64_t budget, std::uint32_t salt) {
    const std::size_t pixels = planned.size();
    const double lambda = FindLambda(planned, deviation, static_cast<double>(budget));
    return RoundToPairs(
        pixels, [&](std::size_t i) { return Wish(planned[i], deviation[i], lambda); }, budget,
        salt);
}

}  // namespace relume::jobs
