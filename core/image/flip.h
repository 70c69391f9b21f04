#pragma once

#include <array>

#include "core/image/separable.h"

namespace relume {

// Mean LDR-FLIP of two linear RGB images clamped to [0,1]: Andersson, Nilsson, Akenine-Moeller,
// Oskarsson, Astroem, Fairchild, "FLIP: A Difference Evaluator for Alternating Images", 2020, seen
// at 67.0206 pixels per degree (0.7 m from a 0.7 m wide monitor of 3840 pixels).
double MeanFlip(const std::array<Plane, 3>& reference, const std::array<Plane, 3>& test, int width);

}  // namespace relume
