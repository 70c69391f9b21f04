#pragma once

#include <string>
#include <vector>

#include "client/cli/interrupts.h"
#include "client/cli/options.h"
#include "client/lib/client.h"

namespace relume::client {

// Shows jobs, and those of groups, one after the other until all are over. Throws CommandError that
// counts those that have not succeeded.
int WatchJobs(Client* client, const std::vector<std::string>& names, const TalkOptions& talk,
              Interrupts* interrupts);

}  // namespace relume::client
