#pragma once

#include <string>
#include <string_view>

#include "server/jobs/job_info.h"
#include "server/rpc/job_message.h"

namespace relume::server {

// What the ledger keeps of a job, as a message, so that later versions read it too.
std::string SaveInfo(const jobs::JobInfo& info, const WallClock& wall);

// And back, without what is expected of the job. Of one that is not over, `used_seconds` or what it
// had used when it was saved, whichever is more, is what it has used at `now`. Throws kDataLoss for
// other bytes.
jobs::JobInfo LoadInfo(std::string_view bytes, double used_seconds, const WallClock& wall,
                       TimePoint now);

}  // namespace relume::server
