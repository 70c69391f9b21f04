#include "server/denoise/nlm_plan.h"

#include <algorithm>
#include <cmath>

namespace relume::denoise {

Plane SpreadSamples(const Plane& error, double samples, double most) {
    Plane counts(error.size(), 0.0f);
    if (error.empty()) {
        return counts;
    }
    const double limit = most * samples / static_cast<double>(error.size());
    std::vector<unsigned char> full(error.size(), 0);
    const auto wish = [&](std::size_t i) {
        return std::isfinite(error[i]) ? std::max(0.0, static_cast<double>(error[i])) : 0.0;
    };
    double left = samples, scale = 0, rest = 0;
    for (bool cut = true; cut;) {
        double sum = 0, open = 0;
        for (std::size_t i = 0; i < error.size(); ++i) {
            sum += full[i] != 0 ? 0.0 : wish(i);
            open += full[i] != 0 ? 0.0 : 1.0;
        }
        scale = sum > 0 ? left / sum : 0;
        rest = sum > 0 ? 0 : left / open;
        cut = false;
        for (std::size_t i = 0; i < error.size(); ++i) {
            if (full[i] == 0 && wish(i) * scale > limit) {
                full[i] = 1;
                left -= limit;
                cut = true;
            }
        }
    }
    for (std::size_t i = 0; i < error.size(); ++i) {
        counts[i] = static_cast<float>(full[i] != 0 ? limit : wish(i) * scale + rest);
    }
    return counts;
}

}  // namespace relume::denoise
