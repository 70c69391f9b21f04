#pragma once

#include <array>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// One half of a frame as a frame of its own, without halves: its means, features and counts; the
// variances are the whole frame's times n / n_half. `half`: 0 or 1. The frame must have halves.
Frame HalfFrame(const Frame& frame, int half);

// The frame at half its width and height, of whole blocks of 2x2 pixels, the last ones of what is
// left: means of colours and features, variances of the means of four, counts in all.
Frame ShrinkFrame(const Frame& frame);

// Both halves of a frame, each filtered without sight of the other.
struct FilteredHalves {
    std::array<std::array<Plane, 3>, 2> color;
};
FilteredHalves FilterHalves(const Denoiser& denoiser, const Frame& frame,
                            const CancelToken& cancel);

// Where the filtered halves disagree: (F_a - F_b)^2 / (F^2 + 1e-3) a pixel, mean over RGB, F their
// mean. Row-major.
Plane Disagreement(const FilteredHalves& halves);

// Unbiased estimate of the squared error of (F_a + F_b) / 2 a pixel and channel (methods 2.8, step
// 3; Bitterli et al. 2016): ((B - F_a)^2 - v_b + (A - F_b)^2 - v_a) / 2 - (F_a - F_b)^2 / 4. Mostly
// noise in one pixel.
std::array<Plane, 3> HalvesError(const Frame& frame, const FilteredHalves& halves);

}  // namespace relume::denoise
