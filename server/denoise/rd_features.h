#pragma once

#include <string>
#include <vector>

#include "server/denoise/feature_prefilter.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// Features as robust denoising compares them: normal mapped to [0, 1], albedo and depth over their
// largest where that is above 1 (depth: always), visibility. A channel a plane, 1 or 3 to a group;
// those that the frame lacks are not there.
struct RdFeaturePlanes {
    std::vector<Plane> value, variance;
    std::vector<Plane> spread;  // max(variance, squared gradient): methods 2.6, step 3
    std::vector<int> group_size;
    std::string names;  // "normal, albedo, depth, visibility"
};
RdFeaturePlanes MakeRdFeatures(const Frame& frame, PrefilteredFeatures features);

}  // namespace relume::denoise
