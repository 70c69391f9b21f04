#include "server/denoise/error_estimate.h"

#include <cmath>

#include "core/image/metrics.h"

namespace relume::denoise {

ErrorEstimate EstimateError(const std::array<const Plane*, 3>& squared_error,
                            const std::array<const Plane*, 3>& noise,
                            const std::array<const Plane*, 3>& reference) {
    ErrorEstimate estimate;
    estimate.map.resize(reference[0]->size());
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < estimate.map.size(); ++i) {
        double error = 0, spread = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const double r = (*reference[c])[i], scale = 1 / (3 * (r * r + kRelMSEEpsilon));
            error += (*squared_error[c])[i] * scale;
            spread += (*noise[c])[i] * scale;
        }
        estimate.map[i] = static_cast<float>(error);
        sum += error;
        squares += spread * spread;
    }
    const auto n = static_cast<double>(estimate.map.size());
    if (n > 0) {
        estimate.relmse = sum / n;
        estimate.margin = 1.96 * std::sqrt(2 * squares) / n;
    }
    return estimate;
}

}  // namespace relume::denoise
