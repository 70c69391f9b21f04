#pragma once

#include <string>

#include "core/base/clock.h"
#include "server/jobs/checkpoint.h"
#include "server/jobs/job_queue.h"
#include "server/rpc/job_message.h"
#include "server/store/snapshot_store.h"

namespace relume::server {

// A film as it is saved: a record of the header, one of each tile, one of the job's info
// (saved_info.h) and one of the checkpoint (jobs/checkpoint.h).

std::string FilmHeader(const jobs::Checkpoint& checkpoint);

// The job's info has used `used_seconds` or more at `now`. Throws kDataLoss, naming the file, if it
// is damaged or another version's, whose samples may differ.
jobs::SavedJob ReadSavedFilm(const store::SnapshotStore& store, const store::SnapshotFile& file,
                             double used_seconds, const WallClock& wall, TimePoint now);

}  // namespace relume::server
