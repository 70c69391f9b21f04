#pragma once

#include <optional>
#include <string>

#include "server/denoise/network/tza.h"

namespace relume::denoise {

// Weights by name, "rt_hdr_alb_nrm", from the first of: NAME.tza in the folder that the environment
// variable RELUME_NETWORKS names; those of the project's own networks, which are part of the
// program (network/weights); share/relume/networks beside the folder of the program;
// relume/networks in $XDG_DATA_HOME, else in ~/.local/share. Nothing if none has it; one that can't
// be read throws.
struct NetworkWeights {
    std::string source;  // the file's path, or "NAME, built in"
    TensorArchive tensors;
};
std::optional<NetworkWeights> FindNetworkWeights(const std::string& name);

// Where FindNetworkWeights finds them, without reading: the path, "NAME, built in", or "".
std::string NetworkSource(const std::string& name);

// Folders that are looked at, for messages: "/usr/local/share/relume/networks, ...".
std::string NetworkFolders();

}  // namespace relume::denoise
