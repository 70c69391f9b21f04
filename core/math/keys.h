#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/math/transform.h"

namespace relume {

// Which of `keys` (at least 2) equally spaced keys a time in [0, 1] lies between.
struct KeyTime {
    std::size_t key = 0;  // and the next one,
    float weight = 0;     // with this weight

    KeyTime(float time, std::size_t keys) {
        const float at = time * static_cast<float>(keys - 1);
        key = std::min(static_cast<std::size_t>(at), keys - 2);
        weight = at - static_cast<float>(key);
    }
};

// The transform at a time in [0, 1]: matrices are interpolated linearly.
Transform Interpolate(const std::vector<Transform>& keys, float time);

}  // namespace relume
