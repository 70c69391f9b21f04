#include "server/jobs/error_curve.h"

#include <algorithm>
#include <cmath>

#include "core/base/check.h"

namespace relume::jobs {
namespace {

constexpr int kLeast = 5, kMost = 16;  // sixteenths: 0.31 to 1
constexpr int kUnknown = 11;
constexpr std::size_t kPoints = 4;  // that are fitted

// How far error * samples^p is from being the same at all points.
double Misfit(std::span<const ErrorPoint> errors, Exponent p) {
    const double last = static_cast<double>(errors.back().samples);
    double sum = 0, squares = 0;
    for (const auto& point : errors) {
        const double constant =
            point.error / errors.back().error * Power(static_cast<double>(point.samples) / last, p);
        sum += constant;
        squares += constant * constant;
    }
    const auto n = static_cast<double>(errors.size());
    return squares * n / (sum * sum);
}

bool Usable(const ErrorPoint& point) {
    return point.samples > 0 && point.error > 0 && std::isfinite(point.error);
}

}  // namespace

double Power(double x, Exponent p) {
    const double root = std::sqrt(std::sqrt(std::sqrt(std::sqrt(x))));
    double power = 1;
    for (int k = 0; k < p.sixteenths; ++k) {
        power *= root;
    }
    return power;
}

double Root(double x, Exponent p, double limit) {
    if (!(Power(limit, p) > x)) {
        return limit;
    }
    double low = 1, high = limit;
    for (int step = 0; step < 60; ++step) {
        const double middle = 0.5 * (low + high);
        (Power(middle, p) < x ? low : high) = middle;
    }
    return high;
}

Exponent FitExponent(std::span<const ErrorPoint> errors, bool filtered) {
    if (!filtered) {
        return {16};
    }
    errors = errors.last(std::min(errors.size(), kPoints));
    if (errors.size() < 2 || !std::all_of(errors.begin(), errors.end(), Usable) ||
        errors.front().samples == errors.back().samples) {
        return {kUnknown};
    }
    Exponent best{kLeast};
    for (int k = kLeast + 1; k <= kMost; ++k) {
        if (Misfit(errors, {k}) < Misfit(errors, best)) {
            best = {k};
        }
    }
    return best;
}

double FallsBetween(const ErrorPoint& from, const ErrorPoint& to) {
    if (from.samples == 0 || to.samples <= from.samples || !(from.error > 0 && to.error > 0)) {
        return 0;
    }
    return std::log(from.error / to.error) /
           std::log(static_cast<double>(to.samples) / static_cast<double>(from.samples));
}

double ExpectedError(std::span<const ErrorPoint> errors, Exponent p, double samples) {
    RELUME_CHECK(!errors.empty());
    return errors.back().error *
           Power(static_cast<double>(errors.back().samples) / std::max(1.0, samples), p);
}

}  // namespace relume::jobs
