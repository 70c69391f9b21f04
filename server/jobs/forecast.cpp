#include "server/jobs/forecast.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume::jobs {
namespace {

constexpr double kFarthest = 64;  // times the samples of the newest estimate
constexpr double kLeastSpread = 0.05;
constexpr int kExponentSpread = 2;  // sixteenths, where the points do not tell
constexpr double kNever = std::numeric_limits<double>::infinity();

bool KnowsError(const ForecastInput& input) {
    return !input.errors.empty() && input.errors.back().samples > 0 &&
           input.errors.back().error > 0 && std::isfinite(input.errors.back().error);
}

// Samples with which the image would be done by budgets other than time; kNever: none tells.
double SamplesAtEnd(const ForecastInput& input, Exponent p) {
    double samples =
        static_cast<double>(PixelCap(input.budgets)) * static_cast<double>(input.pixels);
    bool known = input.budgets.max_spp.has_value();
    if (input.budgets.samples) {
        samples = std::min(samples, static_cast<double>(*input.budgets.samples));
        known = true;
    }
    if (input.budgets.target && KnowsError(input)) {
        const ErrorPoint& now = input.errors.back();
        const double ratio = now.error / *input.budgets.target;
        const double needed =
            static_cast<double>(now.samples) * (ratio > 1 ? Root(ratio, p, 1e12) : 1);
        samples = std::min(samples, needed);
        known = true;
    }
    return known ? samples : kNever;
}

// Exponents that the steps between neighbouring points speak for.
struct ExponentRange {
    Exponent low, high;
};
ExponentRange RangeOf(const ForecastInput& input, Exponent p) {
    int low = p.sixteenths - kExponentSpread, high = p.sixteenths + kExponentSpread;
    if (input.errors.size() >= 3) {
        low = high = p.sixteenths;
        const auto newest = input.errors.last(3);
        for (std::size_t i = 1; i < newest.size(); ++i) {
            const double more =
                static_cast<double>(newest[i].samples) / static_cast<double>(newest[i - 1].samples);
            const double less = newest[i - 1].error / newest[i].error;
            if (more > 1 && less > 0 && std::isfinite(less)) {
                const int slope =
                    static_cast<int>(std::lround(16 * std::log(less) / std::log(more)));
                low = std::min(low, slope);
                high = std::max(high, slope);
            }
        }
    }
    return {{std::max(low, 4)}, {std::min(std::max(high, 4), 32)}};
}

// Seconds from now to the result at this speed and exponent.
double SecondsLeft(const ForecastInput& input, double speed, Exponent p) {
    const double samples = SamplesAtEnd(input, p);
    double left = kNever;
    if (samples < kNever && speed > 0) {
        left =
            std::max(0.0, samples - static_cast<double>(input.done)) / speed + input.finish_seconds;
    }
    if (input.budgets.seconds) {
        left = std::min(left, std::max(0.0, *input.budgets.seconds - input.seconds));
    }
    return left;
}

}  // namespace

std::vector<ForecastPoint> Forecast(const ForecastInput& input) {
    if (!KnowsError(input) || input.speed.mean <= 0) {
        return {};
    }
    const Exponent p = FitExponent(input.errors, input.filtered);
    const auto first = static_cast<double>(input.errors.back().samples);
    double end = std::min(SamplesAtEnd(input, p), kFarthest * first);
    if (input.budgets.seconds) {
        const double time = *input.budgets.seconds - input.seconds - input.finish_seconds;
        end =
            std::min(end, static_cast<double>(input.done) + std::max(0.0, time) * input.speed.mean);
    }
    end = std::max(end, first);
    std::vector<ForecastPoint> curve;
    const auto add = [&](double samples) {
        const double more = std::max(0.0, samples - static_cast<double>(input.done));
        curve.push_back({static_cast<std::uint64_t>(std::llround(samples)),
                         input.seconds + more / input.speed.mean + input.finish_seconds,
                         ExpectedError(input.errors, p, samples)});
    };
    for (double samples = first; samples < end; samples *= 2) {
        add(samples);
    }
    add(end);
    return curve;
}

std::optional<double> SamplesLeft(const ForecastInput& input) {
    const double end = SamplesAtEnd(input, FitExponent(input.errors, input.filtered));
    double left = std::max(0.0, end - static_cast<double>(input.done));
    if (input.budgets.seconds && input.speed.mean > 0) {
        const double time = *input.budgets.seconds - input.seconds - input.finish_seconds;
        left = std::min(left, std::max(0.0, time) * input.speed.mean);
    }
    return left == kNever ? std::nullopt : std::optional(left);
}

std::optional<Eta> EstimateEta(const ForecastInput& input) {
    const Exponent p = FitExponent(input.errors, input.filtered);
    Eta eta;
    eta.seconds = SecondsLeft(input, input.speed.mean, p);
    if (eta.seconds == kNever) {
        return std::nullopt;
    }
    const ExponentRange range = RangeOf(input, p);
    eta.low = std::min(SecondsLeft(input, input.speed.high, range.high),
                       (1 - kLeastSpread) * eta.seconds);
    eta.high =
        std::max(SecondsLeft(input, input.speed.low, range.low), (1 + kLeastSpread) * eta.seconds);
    if (input.budgets.seconds) {
        eta.high =
            std::min(eta.high, std::max(eta.seconds, *input.budgets.seconds - input.seconds));
    }
    return eta;
}

}  // namespace relume::jobs
