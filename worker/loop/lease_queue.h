#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/base/cancel_token.h"
#include "core/film/tile.h"
#include "worker/loop/scene_loader.h"
#include "worker/loop/work_stream.h"

namespace relume::worker {

// A lease as the worker holds it.
struct HeldLease {
    std::uint64_t id = 0;
    std::string job;
    std::uint32_t epoch = 0;
    std::uint64_t unit = 0;
    std::string ticket;
    std::uint64_t task_digest = 0;  // codec::TaskDigest
    TileTask task;
    std::shared_ptr<const LoadedScene> scene;  // null until it is loaded
    std::shared_ptr<WorkStream> stream;  // whence it came and where its result goes; null in tests
    std::shared_ptr<CancelToken> cancel = std::make_shared<CancelToken>();
};

// The leases of a worker, first come, first begun. Thread-safe: the control thread fills it, render
// threads empty it.
class LeaseQueue {
  public:
    void Push(HeldLease lease);
    // Waits for a lease whose scene is loaded; nothing once the queue is closed. Finish follows.
    std::optional<HeldLease> Take();
    void Finish(const HeldLease& lease);

    // Gives the scene to all waiting leases of the job.
    void SetScene(const std::string& job, std::shared_ptr<const LoadedScene> scene);

    // These remove leases that have not begun and answer with their ids.
    std::vector<std::uint64_t> DropJob(const std::string& job);
    // Those that came by `stream`: numbers of another server may be the same. Also cancels begun
    // ones.
    std::vector<std::uint64_t> Drop(const std::vector<std::uint64_t>& ids,
                                    const WorkStream* stream = nullptr);
    std::vector<std::uint64_t> DropAll();

    void CancelRunning();
    // Those that came by another stream.
    void CancelOthers(const WorkStream* stream);
    // True if no lease was running at some moment before the time was up.
    bool WaitIdle(std::chrono::milliseconds limit);
    void Close();

    std::size_t held() const;

  private:
    template <typename Predicate>
    std::vector<std::uint64_t> RemoveWaiting(Predicate predicate);

    mutable std::mutex mutex_;  // guards all below
    std::condition_variable changed_;
    std::deque<HeldLease> waiting_;
    struct Running {
        std::uint64_t id;
        std::shared_ptr<WorkStream> stream;
        std::shared_ptr<CancelToken> cancel;
    };
    std::list<Running> running_;
    bool closed_ = false;
};

}  // namespace relume::worker
