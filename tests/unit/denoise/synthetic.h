#pragma once

#include <functional>
#include <random>
#include <string>

#include "core/film/film.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// A frame whose truth is known: a checker of two albedos (8 pixels) under light that falls off
// slowly, in front of a wall that begins at 3/5 of the width, half as bright and with another
// normal and depth.
struct Truth {
    int width, height;

    bool IsWall(int x) const { return 5 * x >= 3 * width; }
    Rgb Color(int x, int y) const;
    PixelSample Features(int x, int y) const;
};

// Uniform in [0, 1), the same on every standard library.
inline double Uniform(std::mt19937* rng) { return (*rng)() * 0x1p-32; }
double Normal(std::mt19937* rng);

// Changes sample `index` of the pixel at (x, y) of the film's window before it is added.
using SampleHook = std::function<void(int x, int y, int index, PixelSample* sample)>;

// `spp` samples a pixel, each the truth times an exponential variable (relative deviation 1).
// `window` may be a crop; (0, 0) of the truth is its first pixel.
Film MakeFilm(const Truth& truth, int spp, unsigned seed, const SampleHook& hook = {});
Film MakeFilm(const TileRect& window, int display_width, int display_height, const Truth& truth,
              int spp, unsigned seed, const SampleHook& hook = {});

// The truth with Gaussian noise of known variance 0.01 of the mean, halves of twice that, features
// free of noise but of variance 1e-3 of one sample.
Frame MakeGaussianFrame(const Truth& truth, unsigned seed);

// Random colours, features and variances, nothing smooth.
Frame MakeRandomFrame(int width, int height, unsigned seed);

// Mean over pixels and RGB of (test - truth)^2 / (truth^2 + 0.001), over columns [x0, x1).
double MrSE(const Truth& truth, const Plane (&test)[3], int x0, int x1);

// What the error says that `call` throws.
std::string MessageOf(const std::function<void()>& call);

}  // namespace relume::denoise
