#pragma once

#include <optional>
#include <string>

#include "core/image/image.h"

namespace relume::client {

// What an image says of its own error: estimated RelMSE and the 95 % interval around it.
struct Claim {
    double relmse = 0, low = 0, high = 0;
};

// The claim under `key` ("relume.relmse") and `key`_interval of the image's metadata; none if the
// first is not there. Throws kInvalidArgument if they are no numbers, or in no order.
std::optional<Claim> ReadClaim(const Image& image, const std::string& key);

// The error of an image at a random sample of its pixels.
struct MeasuredError {
    std::size_t pixels = 0;
    double relmse = 0;             // may be below 0 where the error is small for the probe's noise
    double standard_error = 0;     // of relmse, over the choice of the pixels and the probe's noise
    double low = 0, high = 0;      // 95 % interval
    double worst_share = 0;        // of the pixel that contributes most, in relmse; 0: relmse <= 0
    int worst_x = 0, worst_y = 0;  // that pixel, in the full image
};

// Measures channels layer.R, layer.G, layer.B of `image` ("" for R, G, B). `probe`, of the same
// window, has samples of other seeds than the image in samples.Y, buffer_a.RGB and buffer_b.RGB, at
// pixels chosen at random, and samples.Y 0 elsewhere.
//
// A pixel's error is the mean over RGB of (x - a)(x - b) / (max(ab, 0) + 0.01). The halves a and b
// are independent, so that the product's mean is the squared error of x against the true value,
// whatever noise the halves have: no estimate of that noise needs to be subtracted. Errors are
// skewed over an image, and the standard error of their mean rises with it: the interval is that of
// the normal law for the logarithm of relmse, unless relmse is below two standard errors, when
// there is none, and it is that for relmse itself.
//
// Throws kInvalidArgument if windows differ, fewer than two pixels are probed, or one of them is
// not finite in the image; kNotFound if a channel lacks.
MeasuredError MeasureError(const Image& image, const std::string& layer, const Image& probe);

// Whether claim and measurement agree: their difference, on the scale that MeasureError chose for
// its interval, is within 1.96 standard errors of both together (a two-sided test at 5 %). Of the
// claim, its interval's side towards the measurement counts.
bool Agree(const Claim& claim, const MeasuredError& measured);

}  // namespace relume::client
