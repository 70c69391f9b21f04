#include "server/jobs/paper_rule.h"

namespace relume::jobs {

double SppFactor(double s_c, double s_f) {
    return (s_c * s_c + s_f * s_f) / (s_f * s_f - s_c * s_c);
}

double PrintedGain(const PixelEstimate& c, const PixelEstimate& f) {
    double change = 0;
    for (int channel = 0; channel < 3; ++channel) {
        change += (static_cast<double>(c.variance[channel]) - f.variance[channel]) / 3;
    }
    return SppFactor(c.n, f.n) + change;
}

double CorrectedGain(const PixelEstimate& c, const PixelEstimate& f) {
    const double k = SppFactor(c.n, f.n);
    double gain = 0;
    for (int channel = 0; channel < 3; ++channel) {
        const double value = f.mean[channel];
        const double difference = c.mean[channel] - value;
        const double change = static_cast<double>(c.variance[channel]) - f.variance[channel];
        gain += (k * difference * difference + change) / (value * value + 1e-3) / 3;
    }
    return gain;
}

std::uint32_t PrintedIncrement(double d, const std::array<std::uint32_t, 4>& alpha) {
    if (!(d > 0)) {
        return 0;
    }
    for (std::size_t i = 0; i < 3; ++i) {
        if (d <= kPhi[i]) {
            return alpha[i];
        }
    }
    return alpha[3];
}

std::uint32_t CorrectedIncrement(double d, const std::array<std::uint32_t, 4>& alpha) {
    std::uint32_t increment = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        if (d > kPhi[i]) {
            increment = alpha[i];
        }
    }
    return increment;
}

}  // namespace relume::jobs
