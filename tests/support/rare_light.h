#pragma once

#include <string>

#include "core/film/moments.h"

namespace relume::test {

// How much of the light that is there a sampler brings home, in scenes/rare_light: the middle third
// of the picture sees a lamp with chance p a sample, and has mean 0.55.
struct RareLight {
    Moments energy;  // over seeds: mean of the third / 0.55, 1 without a bias
    // Over seeds: the same less the relative error of the third's samples taken as one heap, each
    // counting alike. That error has mean 0 whatever decides on the counts, as long as decisions
    // look at earlier samples alone (Wald 1944): what is left is the bias of means of pixels whose
    // counts differ, with less noise.
    Moments without_luck;
    Moments samples;   // over seeds: samples a pixel of the third
    Moments other[2];  // over seeds: energy of the thirds with noise and without
};

// `chance`: "050", "020", "005". `spp`: mean samples a pixel. `size`: of the square picture, a
// multiple of 48. Seeds count from 0; they are spread over the threads of ParallelFor.
RareLight MeasureRareLight(const std::string& chance, const std::string& sampler, int spp, int size,
                           int seeds);

}  // namespace relume::test
