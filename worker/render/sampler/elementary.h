#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace relume::render {

// Powers, logarithms and angles with the same bits everywhere: libm picks its code by CPU.

// 2^x, relative error below 3e-7; 0 below 2^-126, at most 2^127.
inline float Exp2(float x) {
    if (x < -126) {
        return 0;
    }
    x = std::min(x, 127.0f);
    const float whole = std::floor(x + 0.5f);
    const float t = (x - whole) * 0.69314718f;  // in +- ln(2) / 2
    const float series =
        1 + t * (1 + t * (0.5f + t * (1.0f / 6 + t * (1.0f / 24 + t * (1.0f / 120 + t / 720)))));
    return series *
           std::bit_cast<float>(static_cast<std::uint32_t>(static_cast<int>(whole) + 127) << 23);
}

// Of positive normal numbers, absolute error below 3e-7 (relative to its whole part's rounding).
inline float Log2(float x) {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
    // Mantissa in [sqrt(1/2), sqrt(2)).
    const std::uint32_t shifted = bits - 0x3f3504f3u;
    const int exponent = static_cast<std::int32_t>(shifted) >> 23;
    const float m = std::bit_cast<float>(bits - (static_cast<std::uint32_t>(exponent) << 23));
    // log m = 2 artanh((m - 1) / (m + 1))
    const float s = (m - 1) / (m + 1), s2 = s * s;
    const float series = s * (2 + s2 * (2.0f / 3 + s2 * (2.0f / 5 + s2 * (2.0f / 7 + s2 * 2 / 9))));
    return static_cast<float>(exponent) + series * 1.44269504f;
}

inline float Exp(float x) { return Exp2(x * 1.44269504f); }

// x^y for x >= 0.
inline float Pow(float x, float y) {
    return x < 1.17549435e-38f ? (y > 0 ? 0.0f : 1.0f) : Exp2(y * Log2(x));
}

// Angle of (x, y) from the x axis, in [-pi, pi]; relative error below 3e-7. 0 at the origin.
inline float Atan2(float y, float x) {
    const float ax = std::abs(x), ay = std::abs(y);
    const float large = std::max(ax, ay), small = std::min(ax, ay);
    if (!(large > 0)) {
        return 0;
    }
    // The arctangent of small / large; above tan(pi / 8), pi / 4 less.
    const bool shifted = small > 0.41421356f * large;
    const float t = shifted ? (small - large) / (small + large) : small / large;
    // Interpolates (atan(t) / t - 1) / t^2 in Chebyshev's nodes.
    const float z = t * t;
    const float series = -0.33333287f + z * (0.19991238f + z * (-0.14024143f + z * 0.08520492f));
    float angle = t + t * z * series;
    angle = shifted ? angle + 0.78539816f : angle;
    angle = ay > ax ? 1.57079633f - angle : angle;
    angle = x < 0 ? 3.14159265f - angle : angle;
    return y < 0 ? -angle : angle;
}

}  // namespace relume::render
