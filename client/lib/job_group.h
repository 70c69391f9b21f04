#pragma once

#include <string>
#include <vector>

#include "client/lib/client.h"

namespace relume::client {

// A new name, "groups/7f3a...", for jobs that belong together.
std::string MakeGroupName();
bool IsGroupName(const std::string& name);

// The jobs of these names, in this order; a group stands for its jobs, by frame and then oldest
// first. Each once. Throws kNotFound for a job or a group that the server does not know.
std::vector<v1::Job> FindJobs(Client* client, const std::vector<std::string>& names);
// As that; of groups only those that are not over.
std::vector<v1::Job> FindJobsToChange(Client* client, const std::vector<std::string>& names);

}  // namespace relume::client
