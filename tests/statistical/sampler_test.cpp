#include "worker/render/sampler/sampler.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace relume::render {
namespace {

using Integrand = double (*)(Vec2f);

// Smooth, an edge, and a small disc: what the halves must be independent for.
double Smooth(Vec2f p) { return p.x + p.y; }
double Edge(Vec2f p) { return p.x + 0.3f * p.y < 0.6f ? 1 : 0; }
double Disc(Vec2f p) {
    const float dx = p.x - 0.4f, dy = p.y - 0.55f;
    return dx * dx + dy * dy < 0.04f ? 1 : 0;
}

// E[(A-B)^2 / 4] over the variance of (A+B)/2, over many pixels of n samples each. `point` is a
// point of a pixel.
double HalvesRatio(Integrand f, int n, const std::function<Vec2f(int pixel, int index)>& point) {
    constexpr int kPixels = 8000;
    double estimate = 0, mean = 0, square = 0;
    for (int pixel = 0; pixel < kPixels; ++pixel) {
        double half[2] = {0, 0};
        for (int i = 0; i < n; ++i) {
            half[i & 1] += f(point(pixel, i));
        }
        const double a = half[0] / (n / 2), b = half[1] / (n / 2);
        estimate += (a - b) * (a - b) / 4;
        mean += (a + b) / 2;
        square += (a + b) * (a + b) / 4;
    }
    const double variance = square / kPixels - mean / kPixels * (mean / kPixels);
    return estimate / kPixels / variance;
}

Vec2f TwoScrambles(int pixel, int index) {
    return Sampler(1, pixel % 97, pixel / 97, static_cast<std::uint32_t>(index)).Pair(3);
}

// The rule that does not work: even and odd points of one sequence.
Vec2f OneSequence(int pixel, int index) {
    // Index 2i draws point i of the first scramble.
    return Sampler(1, pixel % 97, pixel / 97, 2 * static_cast<std::uint32_t>(index)).Pair(3);
}

TEST(SamplerHalves, DifferenceEstimatesVarianceOfMean) {
    for (const Integrand f : {Smooth, Edge, Disc}) {
        for (const int n : {8, 16, 64}) {
            const double ratio = HalvesRatio(f, n, TwoScrambles);
            EXPECT_GT(ratio, 0.9) << n;
            EXPECT_LT(ratio, 1.1) << n;
        }
    }
}

TEST(SamplerHalves, ParityOfOneSequenceDoesNot) {
    int wrong = 0;
    for (const Integrand f : {Smooth, Edge, Disc}) {
        for (const int n : {8, 16, 64}) {
            const double ratio = HalvesRatio(f, n, OneSequence);
            wrong += ratio < 0.9 || ratio > 1.1 ? 1 : 0;
        }
    }
    EXPECT_GE(wrong, 7);  // of 9
    EXPECT_GT(HalvesRatio(Smooth, 64, OneSequence), 100);
}

TEST(Sampler, DimensionsAreUncorrelated) {
    // Pairs of dimensions of one path, over pixels and indices: their correlation is that of
    // independent numbers.
    constexpr int kPixels = 4000, kSamples = 8;
    for (const auto& [a, b] : {std::pair{0u, 1u}, {2u, 9u}, {3u, 4u}, {1u, 100u}}) {
        double sum = 0;
        for (int pixel = 0; pixel < kPixels; ++pixel) {
            for (std::uint32_t i = 0; i < kSamples; ++i) {
                const Sampler s(5, pixel % 61, pixel / 61, i);
                sum += (s.Pair(a).x - 0.5) * (s.Pair(b).y - 0.5) * 12;
            }
        }
        const double n = kPixels * kSamples;
        EXPECT_LT(std::abs(sum / n), 4 / std::sqrt(n)) << a << " " << b;
    }
}

}  // namespace
}  // namespace relume::render
