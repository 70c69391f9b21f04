#pragma once

#include <string>
#include <vector>

#include "client/cli/options.h"
#include "client/lib/client.h"

namespace relume::client {

// Puts the images of frames, and of groups of them, where the patterns say. Those that are not
// there (yet) keep no other from being fetched. `skip_existing`: leaves out frames whose files are
// there. Throws CommandError that lists the frames that lack.
int FetchFrames(Client* client, const std::vector<std::string>& names,
                const OutputOptions& patterns, bool skip_existing);

}  // namespace relume::client
