#pragma once

#include <string>
#include <vector>

#include "core/image/image.h"

namespace relume::client {

struct HeatMapFile {
    std::string channel, path;
};

// Writes a heat map of each of the image's channels that has one (samples.Y, relmse.Y, selector.Y,
// decision.Y) as NAME.LAYER.png: NAME is the image's file without its extension, in `folder`, or
// beside the image if that is "". All appear when all are whole. Throws kInvalidArgument if the
// image has none of these channels, OutputError if a file can't be made.
std::vector<HeatMapFile> WriteHeatMaps(const Image& image, const std::string& image_path,
                                       const std::string& folder);

}  // namespace relume::client
