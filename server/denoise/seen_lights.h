#pragma once

#include <memory>
#include <vector>

#include "server/denoise/denoiser.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// Where the frame shows a light that is brighter and noisier than its surroundings are bright: one
// a pixel, 1: there; empty: nowhere. Think of a lamp smaller than a pixel, the rim of a bulb, the
// sun: the noise is whether a sample has met it. A filter that weighs a neighbour's distance by its
// noise takes such a pixel for an estimate of its surroundings, and smears the lamp over them.
//
// No pixel is brighter than its brightest sample but by light that is seen directly, which
// Frame::brightest leaves out: what is above is seen light for certain. None in a frame that does
// not know its brightest samples.
std::vector<unsigned char> FindSeenLights(const Frame& frame);

// The filter on the frame without these lights, which then come back as they were. The name is the
// filter's.
std::unique_ptr<Denoiser> LightsApart(std::unique_ptr<Denoiser> denoiser);

}  // namespace relume::denoise
