#pragma once

#include <cstdint>
#include <vector>

#include "core/base/cancel_token.h"
#include "core/film/sample_records.h"
#include "server/denoise/rpf_kernels.h"

namespace relume::denoise {

// The good samples of a frame, or of one half of it, pixel after pixel.
struct RpfSamples {
    int width = 0, height = 0;
    std::vector<std::size_t> first;            // of each pixel, and the end
    std::vector<const SampleRecord*> records;  // not owned
    bool use_position = true, use_normal = true, use_albedo = true;
    float position_unit = 1;  // scene units: what counts as a tenth of a normal's length

    std::size_t CountOf(std::size_t pixel) const { return first[pixel + 1] - first[pixel]; }
};

// One of the filter's passes over a frame; see rpf.cpp.
struct RpfPass {
    int number = 0;          // from 0
    int box = 55;            // pixels, odd
    double neighbours = 1;   // times box^2 / 2 for each sample of the pixel
    double variance = 0.02;  // of colours and features at 8 samples a pixel, normalised values
    bool spread_spikes = true;
};

// More neighbours are not drawn for any pixel: a bound on memory and time.
inline constexpr std::size_t kMostRpfNeighbours = std::size_t{1} << 17;
// Neighbours that a pixel with so many samples asks for.
std::size_t RpfNeighbours(const RpfPass& pass, std::size_t samples);

// Filters the colours of all samples. A pixel's neighbours are drawn by a hash of its place and of
// the pass: the same bits for any number of threads. `entropy_terms` (rpf_information.h) must reach
// the samples of any pixel and its neighbours. Throws kCancelled soon after `cancel` is set.
std::vector<Rgb> FilterSamples(const RpfSamples& samples, const std::vector<Rgb>& colors,
                               const RpfPass& pass, const std::vector<double>& entropy_terms,
                               RpfKernel kernel, const CancelToken& cancel);

}  // namespace relume::denoise
