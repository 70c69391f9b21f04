#pragma once

#include <array>
#include <cstddef>

#include "core/film/aov.h"

namespace relume {

// The moments of a few pixels as the film keeps them, channel by channel.
inline constexpr std::size_t kMomentsBlock = 64;  // pixels
using MomentsBlock = std::array<std::array<float, kMomentsBlock>, kFilmChannelCount>;

// Puts the samples of `later` to those of `moments`, pixel by pixel (Chan et al. 1979). Not
// associative in the last bit, so that whoever merges does it in order of sample index.
void MergeMoments(const MomentsBlock& later, MomentsBlock* moments);

}  // namespace relume
