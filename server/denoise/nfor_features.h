#pragma once

#include <string>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// The columns that NFOR fits colours by, about 1 in size: depth is over the frame's largest.
struct NforFeatures {
    std::vector<Plane> half[2];
    std::vector<std::size_t> group;  // planes that are filtered together, in order: 3 of a vector
    std::string names;               // "albedo, normal, depth"
};

// Each half of every feature that the frame has and that is not the same everywhere, filtered by
// non-local means with weights from the other half, so that its noise has no say in them (Bitterli
// et al. 2016, section 5.1; methods 2.8, step 1).
NforFeatures FilterHalfFeatures(const Frame& frame, const CancelToken& cancel);

// The means of the filtered halves, filtered once more by what the halves still differ in (step 4).
std::vector<Plane> CombineFeatures(NforFeatures features, int width, int height,
                                   const CancelToken& cancel);

// The same columns of a frame without halves, each filtered by itself (feature_prefilter.h).
struct OneFeatures {
    std::vector<Plane> planes;
    std::string names;
};
OneFeatures FilterFeatures(const Frame& frame, const CancelToken& cancel);

}  // namespace relume::denoise
