#pragma once

#include "core/film/aov.h"

namespace relume::denoise {

// Groups of features, as people name them.
struct FeatureGroup {
    const char* name;
    int first, count;  // FeatureChannel
};
inline constexpr FeatureGroup kFeatureGroups[] = {{"normal", kNormalX, 3},
                                                  {"albedo", kAlbedoR, 3},
                                                  {"depth", kDepth, 1},
                                                  {"visibility", kVisibility, 1}};

}  // namespace relume::denoise
