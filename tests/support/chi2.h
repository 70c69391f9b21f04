#pragma once

#include <functional>
#include <span>
#include <string>

#include "core/math/vec.h"

namespace relume::test {

// Pearson's chi-square test of counts against expected counts. Cells that expect fewer than 5 are
// pooled. Returns the probability of counts at least as far off by chance; 0 if something was
// counted where nothing (below 1e-4 in all) can be.
double ChiSquareProbability(std::span<const double> observed, std::span<const double> expected);

// Probability that a chi-square variable with `freedom` degrees of freedom exceeds x.
double ChiSquareTail(double x, int freedom);

// Significance of one of `tests` tests such that all of them together reject a right sampler once
// in a thousand runs (Sidak).
double SignificanceOf(int tests);

// Draws directions and compares their counts in cells of the sphere with the integral of the
// density.
struct SphereSampler {
    // A direction from two numbers in [0, 1)^2 and a third; false: no sample.
    std::function<bool(Vec2f u, float choice, Vec3f* direction)> sample;
    std::function<double(Vec3f direction)> pdf;
};
// Probability as above. `samples` directions from a fixed pseudo-random sequence.
double TestSphereSampler(const SphereSampler& sampler, int samples = 200000);

// The same on the unit square.
struct SquareSampler {
    std::function<Vec2f(Vec2f u)> sample;
    std::function<double(Vec2f point)> pdf;
};
double TestSquareSampler(const SquareSampler& sampler, int samples = 200000);

}  // namespace relume::test
