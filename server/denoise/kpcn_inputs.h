#pragma once

#include <array>
#include <vector>

#include "server/denoise/frame.h"

namespace relume::denoise {

// What KPCN's network sees of a frame (Bako et al. 2017, section 5; methods 2.9, steps 1 and 2),
// and the colour that its kernels are applied to.
struct KpcnInputs {
    std::array<Plane, 3> albedo;  // that colour is divided by: the surface's and 0.00316; or 1
    std::array<Plane, 3> color;   // divided by that
    // log(1 + color), normal, depth over its largest, albedo: of each its means, the mean variance
    // of its channels (of the means), and the backward differences of its means, first along x,
    // then along y. 10, 10, 4 and 10 planes; zeros where the frame lacks a feature.
    std::vector<Plane> planes;
};
inline constexpr int kKpcnInputs = 34;

KpcnInputs MakeKpcnInputs(const Frame& frame);

}  // namespace relume::denoise
