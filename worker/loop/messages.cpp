#include "worker/loop/messages.h"

#include <fmt/format.h>

#include <utility>

#include "proto/codec/codec.h"
#include "proto/codec/digests.h"
#include "proto/codec/protocol.h"

namespace relume::worker {

v1::WorkRequest MakeHello(const WorkerOptions& options) {
    v1::WorkRequest message;
    auto* hello = message.mutable_hello();
    hello->set_name(options.name);
    hello->set_protocol_version(kProtocolVersion);
    hello->mutable_numeric_class()->set_build(kBuild);
    hello->mutable_numeric_class()->set_isa(options.isa);
    hello->set_threads(options.threads);
    hello->set_machine(options.machine);
    return message;
}

v1::WorkRequest MakeSceneReady(const std::string& job, std::span<const std::string> notes,
                               double seconds) {
    v1::WorkRequest message;
    auto* ready = message.mutable_scene_ready();
    ready->set_job(job);
    ready->mutable_notes()->Assign(notes.begin(), notes.end());
    ready->set_seconds(seconds);
    return message;
}

v1::WorkRequest MakeReport(int credits, std::size_t leases_held) {
    v1::WorkRequest message;
    message.mutable_report()->set_credits(static_cast<std::uint32_t>(credits));
    message.mutable_report()->set_leases_held(static_cast<std::uint32_t>(leases_held));
    return message;
}

v1::WorkRequest MakeLeaseReturn(const std::vector<std::uint64_t>& ids) {
    v1::WorkRequest message;
    message.mutable_lease_return()->mutable_lease_ids()->Assign(ids.begin(), ids.end());
    return message;
}

v1::WorkRequest MakeProblem(const std::string& job, const std::string& text, bool transient) {
    v1::WorkRequest message;
    message.mutable_problem()->set_job(job);
    message.mutable_problem()->set_message(text);
    message.mutable_problem()->set_transient(transient);
    return message;
}

v1::WorkRequest MakeLastWords(const Crash& crash) {
    v1::WorkRequest message = MakeProblem(crash.job, fmt::format("signal {}", crash.signal), true);
    message.mutable_problem()->set_signal(crash.signal);
    message.mutable_problem()->set_lease_id(crash.lease);
    return message;
}

std::vector<v1::WorkRequest> MakeSamples(const HeldLease& lease, const TileResult& result) {
    std::vector<v1::WorkRequest> parts;
    std::uint64_t offset = 0;
    for (std::string& chunk : codec::EncodeSamples(result)) {
        auto* samples = parts.emplace_back().mutable_samples();
        samples->set_lease_id(lease.id);
        samples->set_offset(offset);
        offset += chunk.size();
        samples->set_data(std::move(chunk));
    }
    return parts;
}

v1::WorkRequest MakeResult(const HeldLease& lease, const TileResult& result) {
    v1::WorkRequest message;
    auto* answer = message.mutable_result();
    answer->set_lease_id(lease.id);
    answer->set_job(lease.job);
    answer->set_planes(codec::EncodePlanes(result));
    answer->set_rays(result.rays);
    answer->set_seconds(result.seconds);
    answer->set_epoch(lease.epoch);
    answer->set_unit(lease.unit);
    codec::SetDigests(lease.task_digest, result, answer);
    if (!lease.task.keep_samples) {
        answer->set_ticket(lease.ticket);
    }
    return message;
}

}  // namespace relume::worker
