#pragma once

#include <memory>
#include <string>

#include "server/denoise/network/network.h"

namespace relume::denoise {

// The shapes of Open Image Denoise's published networks: U-Nets of 3x3 convolutions over five
// scales, which read the pooled levels again on the way up, and the input at the last.
GraphSpec OidnGraph();       // base and small: one convolution a scale on the way down
GraphSpec OidnLargeGraph();  // two

// "rt_hdr_alb_nrm" or the like, wherever it lies (network/weights.h). If it isn't there: throws
// kFailedPrecondition, which tells how to get it. Thread-safe; a file is read once.
std::shared_ptr<const Network> LoadOidnNetwork(const std::string& name);

// Throws as that does, without reading it.
void CheckOidnNetwork(const std::string& name);

// What `oidn` runs for colour with clean features, its default, and with noisy ones, and for albedo
// and normal.
inline constexpr const char* kOidnCleanNetwork = "rt_hdr_calb_cnrm";
inline constexpr const char* kOidnNoisyNetwork = "rt_hdr_alb_nrm";
inline constexpr const char* kOidnAlbedoNetwork = "rt_alb";
inline constexpr const char* kOidnNormalNetwork = "rt_nrm";
// Whether all of these are there.
bool HasOidnNetworks();

}  // namespace relume::denoise
