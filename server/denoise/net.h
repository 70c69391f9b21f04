#pragma once

#include <array>
#include <string>

#include "core/base/cancel_token.h"
#include "server/denoise/frame.h"
#include "server/denoise/net_inputs.h"

namespace relume::denoise {

// Which of kNetSlots beside the noisy and the bilateral candidate, which `net` always has.
struct NetParts {
    bool rd = false, nfor = false, oidn = false;
    bool operator==(const NetParts&) const = default;
};

// "net:candidates=rd-nfor".
std::string NetName(const NetParts& parts);

// What the network makes of candidates that are there already: a mean of them, whose weights are a
// pixel's own.
struct NetMix {
    std::array<Plane, 3> color;
    std::array<Plane, kNetSlotCount> weights;  // empty: absent
};
NetMix MixByNetwork(const Frame& frame, const NetCandidates& candidates, const CancelToken& cancel);

}  // namespace relume::denoise
