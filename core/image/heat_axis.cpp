#include "core/image/heat_axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace relume {

double HeatAxis::Position(double value) const {
    if (low == high) {
        return 0.5;
    }
    return std::clamp(std::log(value / low) / std::log(high / low), 0.0, 1.0);
}

HeatAxis FitHeatAxis(std::span<const float> plane, double clipped) {
    std::vector<float> values;
    for (const float value : plane) {
        if (value > 0 && std::isfinite(value)) {
            values.push_back(value);
        }
    }
    if (values.empty()) {
        return {};
    }
    const auto skip = static_cast<std::ptrdiff_t>(clipped * static_cast<double>(values.size()));
    std::nth_element(values.begin(), values.begin() + skip, values.end());
    HeatAxis axis;
    axis.low = values[static_cast<std::size_t>(skip)];
    axis.beyond_low = *std::min_element(values.begin(), values.end()) < axis.low;
    const auto top = values.end() - 1 - skip;
    std::nth_element(values.begin(), top, values.end());
    axis.high = *top;
    axis.beyond_high = *std::max_element(values.begin(), values.end()) > axis.high;
    return axis;
}

std::vector<double> HeatTicks(const HeatAxis& axis, int base, int step) {
    std::vector<double> ticks;
    if (axis.empty()) {
        return ticks;
    }
    const double unit = std::log(base);
    const int first = static_cast<int>(std::floor(std::log(axis.low) / unit));
    const int last = static_cast<int>(std::ceil(std::log(axis.high) / unit));
    for (int exponent = first; exponent <= last; ++exponent) {
        const double tick = std::pow(base, exponent);
        if (exponent % step == 0 && tick > axis.low && tick < axis.high) {
            ticks.push_back(tick);
        }
    }
    return ticks;
}

std::string HeatLabel(double value) {
    if (value == std::floor(value) && value < 1e7) {
        return fmt::format("{:.0f}", value);
    }
    std::string text = fmt::format("{:.3g}", value);
    if (value < 1e-3 || value >= 1e7) {
        // "1.2e-07" without what says nothing.
        const std::string digits = fmt::format("{:.1e}", value);
        const std::string mantissa = digits.substr(0, digits.find('e'));
        text = fmt::format("{}e{}", mantissa.ends_with(".0") ? mantissa.substr(0, 1) : mantissa,
                           std::stoi(digits.substr(digits.find('e') + 1)));
    }
    return text;
}

}  // namespace relume
