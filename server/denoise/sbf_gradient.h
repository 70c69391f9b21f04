#pragma once

#include "core/base/cancel_token.h"
#include "server/denoise/sbf_bank.h"

namespace relume::denoise {

// Magnitude of the Sobel gradient of `values`, replicated at the border (equations 10, 11 of Xing,
// Chen, Li 2020), and its variance if that of the values is `variance`, by the delta method: with
// D_x, D_y the responses of the two masks, (D_x^2 Var D_x + D_y^2 Var D_y) / max(D_x^2 + D_y^2, Var
// D_x + Var D_y).
struct Gradient {
    Plane magnitude, variance;
};
Gradient SobelGradient(const Plane& values, const Plane& variance, int width, int height);

// The eighth feature of sbf-gradient.
void AddGradientGuide(const Frame& frame, const CancelToken& cancel, SbfGuides* guides);

}  // namespace relume::denoise
