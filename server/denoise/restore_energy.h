#pragma once

#include <memory>

#include "server/denoise/denoiser.h"

namespace relume::denoise {

// The filter, and its image made brighter or darker so that the frame's light is that of its
// samples, as far as these are sure of it: filters that weigh a neighbour by its noise lose light
// which few samples carry. With D the sum of the samples' means minus that of the filtered pixels,
// and V the variance of the former, max(0, 1 - V / D^2) of D is given back (James, Stein 1961: a
// firefly alone, whose D^2 is its V, proves nothing), and at most a tenth of the light, lest some
// of them brighten all. A pixel gets of it in proportion to its light's square: of all ways to
// change the sum that is the one of the least squared relative change; and at most a fifth of its
// own. The notes say how much. Lights that the camera sees (seen_lights.h) are left out and as they
// are: few pixels of them would decide for all. For whole frames: any pixel moves all.
std::unique_ptr<Denoiser> RestoreEnergy(std::unique_ptr<Denoiser> denoiser);

}  // namespace relume::denoise
