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

// What is mixed, and how it is made.
struct NetSpec {
    NetParts parts = {true, true};
    std::string without;          // what the bilateral filter is blind to, "" or "albedo-depth"
    bool prefilters_oidn = true;  // albedo and normal are filtered before oidn sees them

    // The filter that makes that candidate.
    std::string FilterOf(std::size_t slot) const;
};

// "net:candidates=rd-nfor"
std::string NetName(const NetSpec& spec);

// What the network makes of candidates that are there already: a mean of them, whose weights are a
// pixel's own.
struct NetMix {
    std::array<Plane, 3> color;
    std::array<Plane, kNetSlotCount> weights;  // empty: absent
};
NetMix MixByNetwork(const Frame& frame, const NetCandidates& candidates, const CancelToken& cancel);

}  // namespace relume::denoise
