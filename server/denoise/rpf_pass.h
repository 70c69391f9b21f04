#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/rpf_kernels.h"
#include "server/denoise/rpf_pixel.h"
#include "server/denoise/rpf_rows.h"

namespace relume::denoise {

// A bound on memory and time: more neighbours are never drawn for a pixel.
inline constexpr std::size_t kMostRpfNeighbours = std::size_t{1} << 17;

// One of the filter's passes over a frame; see rpf.cpp.
struct RpfPass {
    int number = 0;                         // from 0
    int box = 55;                           // pixels, odd
    std::size_t most = kMostRpfNeighbours;  // neighbours of a pixel
    double variance = 0.02;  // of colours and features at 8 samples a pixel, normalised values
    bool spread_spikes = true;
    std::vector<RpfSource> sources;  // colours, features and random numbers that are looked at
    // Differences of first hits that never matter, in scene units for positions; infinite for what
    // is not to be looked at.
    std::array<float, kRpfHit> near{};
};

// Neighbours that a pixel with so many samples asks for: box^2 / 2 for each, or `most`.
std::size_t RpfNeighbours(const RpfPass& pass, std::size_t samples);

// Filters the colours of all samples. A pixel's neighbours are drawn by a hash of its place and of
// the pass: the same bits for any number of threads. `entropy_terms` (rpf_information.h) must reach
// the samples of any pixel and its neighbours. Throws kCancelled soon after `cancel` is set.
std::vector<Rgb> FilterSamples(const RpfSamples& samples, const std::vector<Rgb>& colors,
                               const RpfPass& pass, const std::vector<double>& entropy_terms,
                               const RpfKernels& kernels, const CancelToken& cancel);

}  // namespace relume::denoise
