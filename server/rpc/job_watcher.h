#pragma once

#include <grpcpp/support/server_callback.h>

#include <memory>
#include <string>
#include <utility>

#include "relume/v1/jobs.pb.h"
#include "server/rpc/coordinator.h"
#include "server/rpc/stream_limit.h"

namespace relume::server {

// One WatchJob call: sends the job's events as fast as the client reads them, and ends after the
// event that ends the job. All state is the control thread's. Deletes itself.
class JobWatcher final : public grpc::ServerWriteReactor<v1::WatchJobResponse>, public Listener {
  public:
    static JobWatcher* Start(Coordinator* coordinator, const std::string& name,
                             std::uint64_t from_event, StreamLimit::Slot slot);

    void OnWriteDone(bool ok) override;
    void OnCancel() override;
    void OnDone() override;

    void Advance() override;
    void Stop() override;

  private:
    JobWatcher(Coordinator* coordinator, std::string name, std::uint64_t from_event,
               StreamLimit::Slot slot)
        : coordinator_(coordinator),
          slot_(std::move(slot)),
          name_(std::move(name)),
          next_event_(from_event) {}
    void End(const grpc::Status& status);

    Coordinator* coordinator_;
    const StreamLimit::Slot slot_;
    std::shared_ptr<JobWatcher> self_;  // until OnDone; posted tasks hold it, too
    std::string name_;
    std::uint64_t next_event_;
    v1::WatchJobResponse response_;
    bool writing_ = false;
    bool gone_ = false;      // nobody reads any more
    bool finished_ = false;  // Finish was called
};

}  // namespace relume::server
