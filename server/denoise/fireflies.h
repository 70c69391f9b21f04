#pragma once

#include "server/denoise/frame.h"

namespace relume::denoise {

// Spreads fireflies: a pixel that is brighter than nine tenths of its 5x5 neighbours by six times
// their noise, more than half of whose light came in one sample, becomes what its neighbours are,
// and the rest of its light is spread over 7x7 pixels, so that none is lost (methods 5.7; Sen and
// Darabi 2012 spread so). For filters alone: moments stay as they are. What one pixel has in each
// half is treated apart. A frame that does not know its brightest samples stays as it is. Returns
// the number of such pixels.
std::size_t SpreadFireflies(Frame* frame);

}  // namespace relume::denoise
