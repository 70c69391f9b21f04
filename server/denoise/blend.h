#pragma once

#include <array>
#include <span>
#include <string>

#include "server/denoise/frame.h"

namespace relume::denoise {

// The filters that `blend` mixes, by the names of their weights.
inline constexpr struct {
    const char* name;
    const char* filter;
} kBlended[] = {{"bilateral", "bilateral:mode=robust"}, {"rd", "rd"}, {"nfor", "nfor"}};
inline constexpr std::size_t kBlendedCount = std::size(kBlended);
using BlendWeights = std::array<int, kBlendedCount>;  // 0: that filter does not run

// "blend:bilateral=3,rd=4,nfor=3"; `without`: what the bilateral filter is blind to, "" or
// "albedo-depth". A single weight above 0 gives that filter's own name.
std::string BlendName(const BlendWeights& weights, const std::string& without);

// Draws one pixel's values, of three filters, toward their median m: none is left further from it
// than half of |m| + 0.05, so that a firefly that one filter kept is shared by none. Two values
// stay: they do not tell which is right.
void DrawTogether(std::span<float> values);

// The weighted mean of a channel of some filters' images, a weight above 0 each, drawn together.
Plane MixPlanes(std::span<const Plane* const> planes, std::span<const int> weights);

}  // namespace relume::denoise
