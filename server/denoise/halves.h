#pragma once

#include <array>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// Samples in half 0 or 1 of a pixel that has `n`: the even ones come first.
inline float HalfCount(float n, int half) {
    const auto odd = static_cast<float>(static_cast<int>(n) / 2);
    return half == 0 ? n - odd : odd;
}

// Variance of a half's mean, channel c: the whole frame's times n / n_half.
Plane HalfVariance(const Frame& frame, std::size_t c, int half);

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

// Estimated product of the errors of two filters F and G on the whole frame, in one pixel and
// channel, of what they make of the halves a and b; `noise`: variance of the frame's mean. Mostly
// noise in one pixel, sound in a mean over many.
//
// Each filtered half is judged by the other one, which had no part in what the filter chose for it:
// E_a = (b - F_a) (b - G_a) - v_b, E_b likewise (methods 2.8, step 3; Bitterli et al. 2016). The
// whole frame has twice the samples of a half: its error is 0.57 of a half's, as was measured for
// filters that adapt (bench/sampling). Variance alone would halve, but the kernels narrow as
// samples come in, so that bias and variance both fall: by 2^(-2/3) = 0.63 for the best kernels of
// two dimensions (Stone 1982).
inline float HalvesProduct(float a, float b, std::array<float, 2> f, std::array<float, 2> g,
                           float noise) {
    constexpr float kFalls = 0.57f;
    // A half has twice the variance of the whole.
    return kFalls * (0.5f * ((b - f[0]) * (b - g[0]) + (a - f[1]) * (a - g[1])) - 2 * noise);
}

// That of one filter with itself, its squared error, a pixel and channel.
std::array<Plane, 3> HalvesError(const Frame& frame, const FilteredHalves& halves,
                                 const std::array<Plane, 3>& noise);

}  // namespace relume::denoise
