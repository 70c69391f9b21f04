#pragma once

#include <cstdint>

namespace relume::render {

// Bijective 32-bit mixer of low bias (C. Wellons 2018, found by search: "lowbias32").
inline std::uint32_t Mix(std::uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}

// Order matters: Hash(a, b) != Hash(b, a).
inline std::uint32_t Hash(std::uint32_t a, std::uint32_t b) {
    return Mix(Mix(a) + 0x9e3779b9u + b);
}

// [0, 1): the 24 highest bits, so that 1 is never reached by rounding.
inline float ToUnit(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

}  // namespace relume::render
