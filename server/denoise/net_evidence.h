#pragma once

#include <array>

#include "server/denoise/frame.h"
#include "server/denoise/net_inputs.h"

namespace relume::denoise {

// Holds the network's weights to what was sampled: where a candidate is brighter than the noisy
// image by more than twice the noise, its weight is divided by how much more (Huber 1964), so that
// what it can add is bounded by the noise, whatever it has made up. The others get the rest.
//
// Noise: the pixel's own, and where few samples have met a light not less than its neighbours' have
// relative to the bilateral filter's image. From above alone: noise of radiance is skewed, and a
// pixel that one sample has brightened is rightly darker in the candidates.
//
// `weights`: sums of 1 over the candidates that are there; empty planes: absent.
void HoldToSamples(const Frame& frame, const NetCandidates& candidates,
                   std::array<Plane, kNetSlotCount>* weights);

}  // namespace relume::denoise
