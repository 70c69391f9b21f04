#include "client/lib/job_group.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <random>
#include <set>

#include "client/lib/job_names.h"
#include "core/base/error.h"

namespace relume::client {
namespace {

constexpr const char* kPrefix = "groups/";

std::vector<v1::Job> Find(Client* client, const std::vector<std::string>& names, bool over) {
    std::vector<v1::Job> jobs;
    std::set<std::string> seen;
    for (const std::string& name : names) {
        std::vector<v1::Job> found;
        if (IsGroupName(name)) {
            found = client->List(std::numeric_limits<std::size_t>::max(), name);
            if (found.empty()) {
                ThrowNotFound(fmt::format(
                    "{}: no such group of jobs, or none of its jobs is kept any more; see `relume "
                    "jobs`",
                    name));
            }
            if (!over) {
                std::erase_if(found, [](const v1::Job& job) { return IsOver(job.state()); });
            }
            std::reverse(found.begin(), found.end());
            std::stable_sort(found.begin(), found.end(), [](const v1::Job& a, const v1::Job& b) {
                return a.spec().frame() < b.spec().frame();
            });
        } else {
            found.push_back(client->Get(name));
        }
        for (v1::Job& job : found) {
            if (seen.insert(job.name()).second) {
                jobs.push_back(std::move(job));
            }
        }
    }
    return jobs;
}

}  // namespace

std::string MakeGroupName() {
    std::random_device device;
    return fmt::format("{}{:08x}{:08x}", kPrefix, device(), device());
}

bool IsGroupName(const std::string& name) { return name.starts_with(kPrefix); }

std::vector<v1::Job> FindJobs(Client* client, const std::vector<std::string>& names) {
    return Find(client, names, true);
}

std::vector<v1::Job> FindJobsToChange(Client* client, const std::vector<std::string>& names) {
    return Find(client, names, false);
}

}  // namespace relume::client
