#include "server/rpc/work_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/log.h"
#include "core/film/aov.h"
#include "proto/codec/codec.h"
#include "proto/codec/digests.h"
#include "proto/codec/protocol.h"
#include "server/rpc/status.h"
#include "server/rpc/ticket.h"

namespace relume::server {
namespace {

constexpr std::size_t kMaxText = 2000;
constexpr int kMaxNotes = 100;
constexpr double kHelloSeconds = 10;  // for a worker's first message
// Beyond what credits let wait: the worker does not read.
constexpr std::size_t kMaxOutbox = 20'000;
constexpr std::size_t kTicketSize = 32;  // characters

// A worker's words in one line that can be shown in a terminal.
std::string Clean(const std::string& text) {
    std::string clean = text.substr(0, kMaxText);
    std::replace_if(
        clean.begin(), clean.end(),
        [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 127; }, ' ');
    return clean;
}

}  // namespace

WorkSession* WorkSession::Start(Coordinator* coordinator, StreamLimit::Slot slot) {
    const std::shared_ptr<WorkSession> session(new WorkSession(coordinator, std::move(slot)));
    session->self_ = session;
    coordinator->control().Post([session] {
        session->coordinator_->AddWorkerStream(session.get());
        session->StartRead(&session->request_);
    });
    return session.get();
}

void WorkSession::OnReadDone(bool ok) {
    received_ = ok;
    coordinator_->control().Post([self = self_, ok] {
        self->received_ = false;
        if (self->leaving_) {
            return;
        }
        if (!ok) {
            self->Leave(grpc::Status::OK);
            return;
        }
        const grpc::Status status = Guard([&] { self->Handle(self->request_); });
        if (!status.ok()) {
            self->Leave(status);
            return;
        }
        if (self->request_.has_result()) {
            self->request_ = {};  // large, and the next one may not come for long
        }
        self->StartRead(&self->request_);
        self->Advance();
        self->coordinator_->Changed();
    });
}

void WorkSession::OnWriteDone(bool ok) {
    coordinator_->control().Post([self = self_, ok] {
        self->writing_ = false;
        if (!ok) {
            self->Leave({grpc::StatusCode::CANCELLED, "the worker went away"});
        }
        self->WriteNext();
    });
}

void WorkSession::OnDone() { const auto self = std::move(self_); }

void WorkSession::Handle(const v1::WorkRequest& message) {
    coordinator_->traffic().work_in += message.ByteSizeLong();
    if (message.has_hello()) {
        HandleHello(message.hello());
        return;
    }
    if (worker_ == 0) {
        ThrowInvalidArgument("a worker's first message must be its Hello");
    }
    jobs::JobQueue& queue = coordinator_->queue();
    const TimePoint now = coordinator_->Now();
    queue.Heard(worker_, now);
    const LogScope scope({.worker = queue.WorkerName(worker_)});
    switch (message.message_case()) {
        case v1::WorkRequest::kReport:
            queue.SetCredits(worker_, message.report().credits(), message.report().leases_held());
            break;
        case v1::WorkRequest::kResult:
            HandleResult(message.result());
            break;
        case v1::WorkRequest::kSamples:
            HandleSamples(message.samples());
            break;
        case v1::WorkRequest::kLeaseReturn: {
            const auto& ids = message.lease_return().lease_ids();
            for (const jobs::LeaseId id : ids) {
                samples_.erase(id);
            }
            queue.ReturnLeases(worker_, {ids.begin(), ids.end()});
            break;
        }
        case v1::WorkRequest::kProblem: {
            const v1::JobProblem& problem = message.problem();
            if (jobs_sent_.count(problem.job()) == 0) {
                break;  // it has no business with it
            }
            if (problem.signal() != 0) {
                queue.Crashed(worker_, problem.job(), problem.lease_id(), problem.signal());
                throw Error(ErrorCode::kCancelled, "it dies: " + Clean(problem.message()));
            }
            queue.Problem(worker_, problem.job(), Clean(problem.message()), problem.transient(),
                          now);
            break;
        }
        case v1::WorkRequest::kSceneReady: {
            const v1::SceneReady& ready = message.scene_ready();
            if (jobs_sent_.count(ready.job()) == 0) {
                break;
            }
            std::vector<std::string> notes;
            for (int i = 0; i < std::min(ready.notes_size(), kMaxNotes); ++i) {
                notes.push_back(Clean(ready.notes(i)));
            }
            queue.SceneReady(worker_, ready.job(), notes, now);
            break;
        }
        default:
            break;  // of a newer worker: nothing that we know
    }
}

void WorkSession::HandleHello(const v1::Hello& hello) {
    if (worker_ != 0) {
        ThrowInvalidArgument("a worker says Hello once");
    }
    if (hello.protocol_version() != kProtocolVersion) {
        throw Error(
            ErrorCode::kFailedPrecondition,
            fmt::format(
                "the worker speaks protocol version {}, the server ({}) version {}; use workers "
                "and server of one release",
                hello.protocol_version(), kBuild, kProtocolVersion));
    }
    if (const std::string& build = hello.numeric_class().build(); build != kBuild) {
        throw Error(
            ErrorCode::kFailedPrecondition,
            fmt::format("the worker is '{}', the server '{}', and their samples may differ; "
                        "use workers and server of one release",
                        Clean(build), kBuild));
    }
    jobs::JobQueue& queue = coordinator_->queue();
    const std::string numeric_class = Clean(NumericClassText(hello.numeric_class()));
    worker_ = queue.AddWorker(hello.name(), numeric_class, hello.threads(), coordinator_->Now());
    if (!hello.machine().empty()) {
        queue.SetMachine(worker_, Clean(hello.machine()));
    }
    const LogScope scope({.worker = queue.WorkerName(worker_)});
    spdlog::info("worker {}: is here with {} threads ({})", queue.WorkerName(worker_),
                 hello.threads(), numeric_class);
    v1::WorkResponse response;
    response.mutable_welcome()->set_name(queue.WorkerName(worker_));
    response.mutable_welcome()->set_report_seconds(kReportSeconds);
    Send(std::move(response));
    if (coordinator_->stopping()) {
        Stop();
    }
}

void WorkSession::HandleResult(const v1::LeaseResult& result) {
    jobs::JobQueue& queue = coordinator_->queue();
    const TimePoint now = coordinator_->Now();
    const jobs::LeaseId lease = result.lease_id();
    const LogScope scope({.job = result.job(), .lease = lease});
    const auto samples = samples_.extract(lease);
    const TileTask* lent = result.epoch() == coordinator_->epoch() ? queue.TaskOf(lease) : nullptr;
    if (result.ticket().size() > kTicketSize) {  // would be kept to be sent back
        ThrowInvalidArgument("a ticket has 32 characters");
    }
    // An answer to a lease that is gone, but whose samples may still be wanted.
    std::optional<TileTask> late;
    if (lent == nullptr && !result.ticket().empty()) {
        late = queue.TaskOfUnit(result.job(), result.unit());
        if (late && MakeTicket(coordinator_->secret(), result.job(), result.unit(), *late) !=
                        result.ticket()) {
            late.reset();
        }
    }
    if (lent == nullptr && !late) {
        spdlog::debug("{}: lease {} is answered too late", result.job(), lease);
        queue.AddResult(worker_, 0, result.job(), {}, now);  // counted as late
        coordinator_->Acknowledge(worker_, result.ticket());
        return;
    }
    const TileTask& task = lent != nullptr ? *lent : *late;
    TileResult tile;
    try {
        // An answer may lie about them.
        const auto [job, unit] =
            lent != nullptr ? queue.UnitOf(lease) : std::pair(result.job(), result.unit());
        codec::CheckTaskDigest(coordinator_->TaskDigest(job, unit, task), result);
        tile = codec::DecodePlanes(task, result.planes());
        tile.samples =
            codec::DecodeSamples(task, samples.empty() ? std::string() : samples.mapped());
        tile.rays = result.rays();
        tile.seconds = result.seconds();
        codec::CheckChecksum(tile, result);
    } catch (const Error& error) {
        if (lent != nullptr) {
            queue.RejectResult(worker_, lease, error.what(), now);
        } else {
            queue.RejectLateResult(worker_, result.job(), error.what(), now);
        }
        coordinator_->Acknowledge(worker_, result.ticket());
        return;
    }
    const jobs::ResultVerdict verdict =
        lent != nullptr
            ? queue.AddResult(worker_, lease, result.job(), std::move(tile), now)
            : queue.AddLateResult(worker_, result.job(), result.unit(), std::move(tile), now);
    queue.CountMergeSeconds(result.job(), ToSeconds(coordinator_->Now() - now));
    if (verdict == jobs::ResultVerdict::kMerged) {
        coordinator_->Answered(result.job(), result.unit(), worker_, result.ticket());
    } else {
        coordinator_->Acknowledge(worker_, result.ticket());
    }
}

// What is nobody's or does not follow on what came before is dropped: the result will be short of
// it, and refused.
void WorkSession::HandleSamples(const v1::SampleChunk& chunk) {
    jobs::JobQueue& queue = coordinator_->queue();
    const TileTask* task =
        queue.IsLent(chunk.lease_id(), worker_) ? queue.TaskOf(chunk.lease_id()) : nullptr;
    if (task == nullptr) {
        samples_.erase(chunk.lease_id());
        return;
    }
    const std::size_t due = codec::SampleBytes(*task);
    if (due == 0) {
        return;
    }
    std::string& bytes = samples_[chunk.lease_id()];
    if (chunk.offset() == bytes.size() && chunk.data().size() <= due - bytes.size()) {
        bytes.reserve(due);
        bytes += chunk.data();
    }
}

void WorkSession::Advance() {
    if (leaving_) {
        return;
    }
    if (worker_ == 0) {
        if (ToSeconds(coordinator_->Now() - opened_) > kHelloSeconds) {
            Leave({grpc::StatusCode::DEADLINE_EXCEEDED, "the worker does not say Hello"});
        }
        return;
    }
    if (outbox_.size() >= kMaxOutbox) {
        Leave({grpc::StatusCode::RESOURCE_EXHAUSTED, "the worker does not read what it is sent"});
        return;
    }
    jobs::JobQueue& queue = coordinator_->queue();
    std::erase_if(jobs_sent_, [&](const std::string& job) {
        if (queue.NeedsWorkers(job)) {
            return false;
        }
        v1::WorkResponse response;
        response.mutable_job_over()->set_job(job);
        Send(std::move(response));
        return true;
    });
    if (const auto revoked = queue.TakeRevoked(worker_); !revoked.empty()) {
        v1::WorkResponse response;
        response.mutable_revoke()->mutable_lease_ids()->Add(revoked.begin(), revoked.end());
        Send(std::move(response));
    }
    if (auto tickets = coordinator_->TakeAcknowledged(worker_); !tickets.empty()) {
        v1::WorkResponse response;
        for (auto& ticket : tickets) {
            response.mutable_acknowledge()->add_tickets(std::move(ticket));
        }
        Send(std::move(response));
    }
    while (!stopping_) {
        const auto grant = queue.NextLease(worker_, coordinator_->Now());
        if (!grant) {
            break;
        }
        SendLease(*grant);
    }
}

void WorkSession::SendLease(const jobs::LeaseGrant& grant) {
    if (jobs_sent_.insert(grant.job).second) {
        const CheckedSpec& spec = coordinator_->SpecOf(grant.job);
        v1::WorkResponse response;
        v1::JobContext* context = response.mutable_job();
        context->set_job(grant.job);
        *context->mutable_scene() = codec::ToProto(spec.manifest);
        *context->mutable_settings() = codec::ToProto(spec.settings);
        context->mutable_channels()->Add(FilmChannelNames().begin(), FilmChannelNames().end());
        Send(std::move(response));
    }
    v1::WorkResponse response;
    v1::Lease* lease = response.mutable_lease();
    lease->set_id(grant.id);
    lease->set_job(grant.job);
    codec::TaskToLease(grant.task, lease);
    lease->set_deadline_seconds(grant.deadline_seconds);
    lease->set_epoch(coordinator_->epoch());
    lease->set_unit(grant.unit);
    lease->set_ticket(MakeTicket(coordinator_->secret(), grant.job, grant.unit, grant.task));
    const LogScope scope(
        {.job = grant.job, .worker = coordinator_->queue().WorkerName(worker_), .lease = grant.id});
    spdlog::debug("{}: lease {} of {} samples, due in {:.1f} s", grant.job, grant.id,
                  grant.task.TotalSamples(), grant.deadline_seconds);
    Send(std::move(response));
}

void WorkSession::Stop() {
    if (worker_ == 0) {
        Leave({grpc::StatusCode::UNAVAILABLE, "the server stops"});
    } else if (!std::exchange(stopping_, true)) {
        v1::WorkResponse response;
        response.mutable_drain()->set_come_back(true);
        Send(std::move(response));
    }
}

void WorkSession::NoteReceived() {
    if (worker_ != 0 && received_) {
        coordinator_->queue().Heard(worker_, coordinator_->Now());
    }
}

void WorkSession::Send(v1::WorkResponse message) {
    outbox_.push_back(std::move(message));
    WriteNext();
}

void WorkSession::WriteNext() {
    if (writing_ || finished_) {
        return;
    }
    if (leaving_) {
        finished_ = true;
        Finish(status_);
    } else if (!outbox_.empty()) {
        outgoing_ = std::move(outbox_.front());
        outbox_.pop_front();
        coordinator_->traffic().work_out += outgoing_.ByteSizeLong();
        writing_ = true;
        StartWrite(&outgoing_);
    }
}

void WorkSession::Leave(const grpc::Status& status) {
    if (leaving_) {
        return;
    }
    const auto keep = self_;  // Finish may lead to OnDone at any moment
    leaving_ = true;
    status_ = status;
    outbox_.clear();
    coordinator_->Remove(this);
    if (worker_ != 0) {
        jobs::JobQueue& queue = coordinator_->queue();
        const LogScope scope({.worker = queue.WorkerName(worker_)});
        spdlog::info("worker {}: has left{}", queue.WorkerName(worker_),
                     status.ok() ? "" : fmt::format(" ({})", status.error_message()));
        // Whoever is refused, or leaves because the server stops, is not lost over its work.
        const bool lost = status.ok() || status.error_code() == grpc::StatusCode::CANCELLED;
        if (lost && !coordinator_->stopping()) {
            queue.LoseWorker(worker_, "was lost", coordinator_->Now());
        } else {
            queue.RemoveWorker(worker_);
        }
        coordinator_->TakeAcknowledged(worker_);
        worker_ = 0;
    }
    WriteNext();
    coordinator_->Changed();
}

}  // namespace relume::server
