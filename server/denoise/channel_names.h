#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/image/image.h"

namespace relume::denoise {

// What a frame is read from. The order is that of the table in channel_names.cpp.
enum class Quantity {
    kColor,
    kMeanVariance,    // of the mean, RGB
    kSampleVariance,  // of one sample, RGB
    kCount,
    kBrightest,
    kHalfA,
    kHalfB,
    kAlbedo,
    kNormal,
    kDepth,
    kVisibility,
};

// Channels of an image, indices in order of component.
using ChannelGroup = std::vector<int>;

// The first name in the table that the image has whole, in front of it any layers ("ViewLayer.");
// of several such layers the file's first.
std::optional<ChannelGroup> FindChannels(const Image& image, Quantity quantity);

// The group `channels` of a feature with a suffix after its layer, as Relume names it:
// "_variance" (of the mean), "_a" and "_b" (halves).
std::optional<ChannelGroup> FindSuffixed(const Image& image, const ChannelGroup& channels,
                                         const std::string& suffix);

// "noisy.R, noisy.G, noisy.B"
std::string NamesOf(const Image& image, const ChannelGroup& channels);

// The channels below a layer, "ViewLayer" or "Scene.ViewLayer", without that part of their names.
// Throws kNotFound with the layers that there are.
Image SelectLayer(const Image& image, const std::string& layer);

}  // namespace relume::denoise
