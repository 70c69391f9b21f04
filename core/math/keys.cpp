#include "core/math/keys.h"

#include <array>

namespace relume {

Transform Interpolate(const std::vector<Transform>& keys, float time) {
    const KeyTime at(time, keys.size());
    const auto& a = keys[at.key].rows();
    const auto& b = keys[at.key + 1].rows();
    std::array<float, 12> rows{};
    for (std::size_t i = 0; i < rows.size(); ++i) {
        rows[i] = (1 - at.weight) * a[i] + at.weight * b[i];
    }
    return Transform(rows);
}

}  // namespace relume
