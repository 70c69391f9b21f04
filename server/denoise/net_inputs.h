#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "server/denoise/denoiser.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// The images that `net` mixes: the noisy one, and filters' by the names of the network's inputs.
inline constexpr struct {
    const char* name;
    const char* filter;
} kNetSlots[] = {{"none", "none"},
                 {"bilateral", "bilateral:mode=robust"},
                 {"rd", "rd:radius=5,lights=apart"},
                 {"nfor", "nfor:lights=apart"},
                 {"oidn", "oidn:lights=apart"}};
inline constexpr std::size_t kNetSlotCount = std::size(kNetSlots);
// Their numbers.
inline constexpr std::size_t kBilateralSlot = 1, kRdSlot = 2, kNforSlot = 3, kOidnSlot = 4;
using NetCandidates = std::array<const Result*, kNetSlotCount>;  // null: absent

// Names of the network's inputs, in order. Those of a candidate start with its name and a dot.
std::vector<std::string> NetInputNames();

// The inputs, a plane each, all within about [-2, 2]: logarithms of the candidates' radiance (so
// that a difference is a relative one), what they say of their own error, how far they are from the
// noisy image over its noise in 5x5 pixels (which tells bias: SURE's first term), relative noise
// and count of the samples, features and their noise. Of what is absent: zeros. The noisy and the
// bilateral candidate must be there.
std::vector<Plane> MakeNetInputs(const Frame& frame, const NetCandidates& candidates);

}  // namespace relume::denoise
