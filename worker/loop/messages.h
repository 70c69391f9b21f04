#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/film/tile.h"
#include "relume/v1/work.pb.h"
#include "worker/loop/crash_report.h"
#include "worker/loop/lease_queue.h"
#include "worker/loop/worker_options.h"

namespace relume::worker {

// What a worker tells the server, message by message (proto/relume/v1/work.proto).
v1::WorkRequest MakeHello(const WorkerOptions& options);
v1::WorkRequest MakeSceneReady(const std::string& job, std::span<const std::string> notes,
                               double seconds);
v1::WorkRequest MakeReport(int credits, std::size_t leases_held);
v1::WorkRequest MakeLeaseReturn(const std::vector<std::uint64_t>& ids);
// `transient`: another worker may do better.
v1::WorkRequest MakeProblem(const std::string& job, const std::string& text, bool transient);
v1::WorkRequest MakeLastWords(const Crash& crash);
// The samples one by one, where the lease asks for them: they go before the result.
std::vector<v1::WorkRequest> MakeSamples(const HeldLease& lease, const TileResult& result);
// With the lease's ticket, to be kept until it is acknowledged; but with samples, which are not
// kept.
v1::WorkRequest MakeResult(const HeldLease& lease, const TileResult& result);

}  // namespace relume::worker
