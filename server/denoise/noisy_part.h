#pragma once

#include <memory>
#include <string>

#include "core/film/tile.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/error_estimate.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// The part of a frame that filters have work in: a rectangle outside of which lies no more than a
// thousandth of the noise, and a margin. Noise is the variance of the mean relative to its square
// (as RelMSE, epsilon 0.01; mean over RGB), at most 1 a pixel, more than which one sample alone
// can't make. The whole frame, if the part is nearly that, or there is no noise.
TileRect FindNoisyPart(const Frame& frame);

// Whether a rectangle of a frame is all of it.
bool IsWhole(const TileRect& rect, const Frame& frame);

// An estimate for the noisy part `rect` of a frame as one for the frame, the rest of which is left
// as it is: that has the error of its samples.
ErrorEstimate ExpandEstimate(const ErrorEstimate& of_part, const TileRect& rect,
                             const Frame& frame);

// The filter on the noisy part of a frame alone: any filter's parameter where=noisy. What is
// outside stays as it is, bit for bit. One that chooses sees that part, and so do those that it
// takes. `parameter` is what its name says of that; empty: nothing, as auto always does it.
inline constexpr const char* kWhereNoisy = "where=noisy";
std::unique_ptr<Denoiser> OnNoisyPart(std::shared_ptr<const Denoiser> denoiser,
                                      const std::string& parameter);

}  // namespace relume::denoise
