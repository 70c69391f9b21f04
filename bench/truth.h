#pragma once

#include <functional>
#include <vector>

#include "bench/sample_store.h"

namespace relume::bench {

// Errors of an image as core/image/metrics.h defines them, less the truth's own.
struct Score {
    double mrse = 0, trimmed = 0, relmse = 0, energy = 0;
};

// What all samples of the other seeds say, a pixel and channel.
struct Truth {
    std::vector<Rgb> mean, floor;  // and the variance of that mean, from its scatter over seeds
    std::vector<Rgb> variance;     // of one sample
    Score error;                   // of `mean` itself; no energy
};

// For each of the first `judged` seeds, the truth that it is judged by.
std::vector<Truth> FindTruths(const std::vector<SampleStore>& stores, std::size_t judged);

Score Compare(const Truth& truth, const std::function<double(std::size_t pixel, int c)>& value);

}  // namespace relume::bench
