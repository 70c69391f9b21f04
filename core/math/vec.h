#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace relume {

inline constexpr float kPi = 3.14159265358979323846f;
inline constexpr float kInvPi = 0.31830988618379067154f;

struct Vec2f {
    float x = 0, y = 0;
};

// A point, a direction or linear Rec. 709 RGB, as its name says.
struct Vec3f {
    float x = 0, y = 0, z = 0;

    float& operator[](int i) { return (&x)[i]; }
    float operator[](int i) const { return (&x)[i]; }
    friend bool operator==(const Vec3f&, const Vec3f&) = default;
};
using Rgb = Vec3f;

inline Vec2f operator+(Vec2f a, Vec2f b) { return {a.x + b.x, a.y + b.y}; }
inline Vec2f operator-(Vec2f a, Vec2f b) { return {a.x - b.x, a.y - b.y}; }
inline Vec2f operator*(Vec2f a, float s) { return {a.x * s, a.y * s}; }

inline Vec3f operator+(Vec3f a, Vec3f b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3f operator-(Vec3f a, Vec3f b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3f operator-(Vec3f a) { return {-a.x, -a.y, -a.z}; }
inline Vec3f operator*(Vec3f a, Vec3f b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
inline Vec3f operator*(Vec3f a, float s) { return {a.x * s, a.y * s, a.z * s}; }
inline Vec3f operator*(float s, Vec3f a) { return a * s; }
inline Vec3f operator/(Vec3f a, float s) { return a * (1.0f / s); }
inline Vec3f& operator+=(Vec3f& a, Vec3f b) { return a = a + b; }
inline Vec3f& operator*=(Vec3f& a, Vec3f b) { return a = a * b; }
inline Vec3f& operator*=(Vec3f& a, float s) { return a = a * s; }

inline float Dot(Vec3f a, Vec3f b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3f Cross(Vec3f a, Vec3f b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float Length2(Vec3f a) { return Dot(a, a); }
inline float Length(Vec3f a) { return std::sqrt(Length2(a)); }
inline Vec3f Normalize(Vec3f a) { return a * (1.0f / Length(a)); }
inline Vec3f Lerp(float t, Vec3f a, Vec3f b) { return a * (1 - t) + b * t; }
inline Vec3f Min(Vec3f a, Vec3f b) {
    return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
inline Vec3f Max(Vec3f a, Vec3f b) {
    return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}
inline float MaxComponent(Vec3f a) { return std::max(a.x, std::max(a.y, a.z)); }
inline bool IsFinite(Vec3f a) {
    return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

// Rec. 709 luminance of a linear colour.
inline float Luminance(Rgb c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

// Mean of the three channels: the papers' avg3.
inline float Average(Rgb c) { return (c.x + c.y + c.z) * (1.0f / 3.0f); }

struct Vec3u {
    std::uint32_t x = 0, y = 0, z = 0;
};

}  // namespace relume
