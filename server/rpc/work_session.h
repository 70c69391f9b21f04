#pragma once

#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "relume/v1/work.pb.h"
#include "server/rpc/coordinator.h"
#include "server/rpc/stream_limit.h"

namespace relume::server {

// One worker's stream: from its Hello to its end. A message is handled before the next one is read,
// so that a worker can't flood the server; what is to be sent waits in a queue that the worker's
// credits bound. All state is the control thread's. Deletes itself.
class WorkSession final : public grpc::ServerBidiReactor<v1::WorkRequest, v1::WorkResponse>,
                          public Listener {
  public:
    static WorkSession* Start(Coordinator* coordinator, StreamLimit::Slot slot);

    void OnReadDone(bool ok) override;
    void OnWriteDone(bool ok) override;
    void OnDone() override;

    // Sends what jobs are over, revocations, and leases as far as the worker's credits go.
    void Advance() override;
    // Asks the worker to finish and leave.
    void Stop() override;
    void NoteReceived() override;

  private:
    WorkSession(Coordinator* coordinator, StreamLimit::Slot slot)
        : coordinator_(coordinator), slot_(std::move(slot)), opened_(coordinator->Now()) {}

    // Each throws what ends the stream.
    void Handle(const v1::WorkRequest& message);
    void HandleHello(const v1::Hello& hello);
    void HandleResult(const v1::LeaseResult& result);
    void HandleSamples(const v1::SampleChunk& chunk);

    void SendLease(const jobs::LeaseGrant& grant);
    void Send(v1::WorkResponse message);
    void WriteNext();
    // Gives back what the worker held; the stream ends when the write under way is done.
    void Leave(const grpc::Status& status);

    Coordinator* coordinator_;
    const StreamLimit::Slot slot_;
    TimePoint opened_;
    std::shared_ptr<WorkSession> self_;  // until OnDone; posted tasks hold it, too
    v1::WorkRequest request_;
    std::atomic<bool> received_{false};  // request_ waits for the control thread
    jobs::WorkerId worker_ = 0;          // 0: no Hello yet, or gone
    std::set<std::string> jobs_sent_;    // whose JobContext the worker has, those over taken out
    std::map<jobs::LeaseId, std::string> samples_;  // that came ahead of their results
    std::deque<v1::WorkResponse> outbox_;
    v1::WorkResponse outgoing_;
    bool writing_ = false;   // a write is under way
    bool stopping_ = false;  // Drain was sent
    bool leaving_ = false;
    bool finished_ = false;  // Finish was called
    grpc::Status status_;
};

}  // namespace relume::server
