#pragma once

#include <array>
#include <string>

#include "core/base/cancel_token.h"
#include "server/denoise/frame.h"
#include "server/denoise/net_inputs.h"

namespace relume::denoise {

// Which of kNetSlots. The first two, the noisy and the bilateral candidate, are always there.
using NetParts = std::array<bool, kNetSlotCount>;

// Whether what that candidate needs is there: the weights of a network that is not ours.
bool HasNetSlot(std::size_t slot);
// Whether `net` mixes that candidate in such an image: oidn's network sees of one thinner than 16
// pixels mostly the blackness beyond its border.
bool SuitsNetSlot(std::size_t slot, const Frame& frame);

// "net:candidates=rd-nfor"; `without`: what the bilateral filter is blind to, "" or "albedo-depth".
std::string NetName(const NetParts& parts, const std::string& without);

// What the network makes of candidates that are there already: a mean of them, whose weights are a
// pixel's own.
struct NetMix {
    std::array<Plane, 3> color;
    std::array<Plane, kNetSlotCount> weights;  // empty: absent
};
NetMix MixByNetwork(const Frame& frame, const NetCandidates& candidates, const CancelToken& cancel);

}  // namespace relume::denoise
