#pragma once

#include <memory>

#include "server/denoise/denoiser.h"

namespace relume::denoise {

// The filter, and its image made brighter or darker so that the frame's light is that of its
// samples: filters that weigh a neighbour by its noise lose light which few samples carry. The sum
// of the samples' means minus that of the filtered pixels is given back, all of it although it has
// the samples' noise: filters do lose light, so that less would be further off, in the mean and for
// most single images (docs/adr/2026-11-27-all-lost-light.md). A pixel counts no more of it than
// 3 % of the image's light, lest a firefly brightens all, and all together 15 %. A pixel gets of it
// in proportion to its light's square: of all ways to change the sum that is the one of the least
// squared relative change; and at most a fifth of its own. The notes say how much. Lights that the
// camera sees (seen_lights.h) get nothing of it: they are as bright as they were sampled. For whole
// frames: any pixel moves all.
std::unique_ptr<Denoiser> RestoreEnergy(std::unique_ptr<Denoiser> denoiser);

}  // namespace relume::denoise
