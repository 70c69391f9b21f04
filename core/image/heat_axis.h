#pragma once

#include <span>
#include <string>
#include <vector>

namespace relume {

// The logarithmic axis of a heat map.
struct HeatAxis {
    double low = 0, high = 0;  // above 0; both 0: the plane has no finite value above 0
    bool beyond_low = false, beyond_high = false;  // values lie beyond that end

    bool empty() const { return high == 0; }
    // Where a value above 0 lies: 0 at `low`, 1 at `high`, clamped; the middle if they are equal.
    double Position(double value) const;
};

// The range of the finite values above 0, less the share `clipped` of them at either end.
HeatAxis FitHeatAxis(std::span<const float> plane, double clipped);

// The powers of `base` strictly within the axis; of every `step`-th exponent.
std::vector<double> HeatTicks(const HeatAxis& axis, int base, int step);

// A number above 0, short: "0.0512", "1.2e-7", "1048576".
std::string HeatLabel(double value);

}  // namespace relume
