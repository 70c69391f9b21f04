#pragma once

#include <cstddef>
#include <vector>

#include "core/math/transform.h"

// How loaders turn motion of any kind into the keys that scene.h wants: what moves is worked out at
// kMotionSamples equally spaced times while the shutter is open, and every 2nd, 4th, ... of them is
// kept as a key, as few as will do.
namespace relume {

inline constexpr std::size_t kMotionSamples = 65;
inline constexpr std::size_t kMostKeys = 33;
// How far linear interpolation between keys may be off: of a transform's axes, as a share of their
// length (5 degrees of rotation a key; 1 / 1000 of a thing's size); of its origin, as a share of
// the way it goes; of a morph target's weight, of 1.
inline constexpr float kMotionError = 1e-3f;

// At kMotionSamples times, the first at the shutter's opening and the last at its closing; or one
// alone, for all times.
using SampledTransform = std::vector<Transform>;
using SampledWeights = std::vector<std::vector<float>>;

// The least of 2, 3, 5, 9, 17, 33 that keeps to kMotionError at all samples, or else 33; 1 if it
// stands still (within rounding).
std::size_t KeysNeeded(const SampledTransform& samples);
std::size_t KeysNeeded(const SampledWeights& samples);

// The samples' index of a key, of `keys` in all (at least 2).
inline std::size_t SampleOfKey(std::size_t key, std::size_t keys) {
    return key * (kMotionSamples - 1) / (keys - 1);
}

// As Instance::motion: empty if it stands still.
std::vector<Transform> MotionKeys(const SampledTransform& samples);

// left * right at each time.
SampledTransform Multiply(const SampledTransform& left, const SampledTransform& right);

// Values at kMotionSamples times from `open` on, `seconds` apart in all; at one if that is 0.
std::vector<double> SampleTimes(double open, double seconds);

}  // namespace relume
