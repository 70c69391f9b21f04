#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "core/base/cancel_token.h"
#include "core/base/clock.h"
#include "server/jobs/job_queue.h"
#include "server/metrics/farm_status.h"
#include "server/rpc/executor.h"
#include "server/rpc/finish_times.h"
#include "server/rpc/job_message.h"
#include "server/rpc/job_spec.h"
#include "server/rpc/traffic.h"
#include "server/store/blob_store.h"
#include "server/store/data_folder.h"
#include "server/store/result_store.h"

namespace relume::server {

struct CoordinatorOptions {
    std::filesystem::path data;  // holds blobs, results and a lock
    std::uint64_t blob_quota = std::uint64_t{64} << 30;
};

// An open stream that wants to hear of changes. Called on the control thread.
class Listener {
  public:
    virtual ~Listener() = default;
    // Something may have changed: send what there is to send.
    virtual void Advance() = 0;
    // The server is going to stop.
    virtual void Stop() = 0;
};

// What the services share: the queue of jobs, the store, and the threads that work on them. The
// control thread owns all state of jobs and workers; the io thread reads and writes files; the
// plan thread plans passes, the filter thread finishes images, one at a time each. Services post
// their work there and answer from there.
class Coordinator {
  public:
    explicit Coordinator(const CoordinatorOptions& options);
    // All streams must be closed by now. Filters under way are cancelled.
    ~Coordinator();

    SerialExecutor& control() { return control_; }
    SerialExecutor& io() { return io_; }
    store::BlobStore& blobs() { return blobs_; }                    // thread-safe
    const store::ResultStore& results() const { return results_; }  // thread-safe
    TimePoint Now() const { return clock_.Now(); }
    Traffic& traffic() { return traffic_; }  // thread-safe
    // What is seen from outside. Thread-safe; waits for the control thread, in vain if that does
    // not come to it within seconds.
    std::optional<metrics::FarmStatus> AskStatus();
    // Rises with every start of the server: answers to leases of an earlier one are dropped.
    std::uint32_t epoch() const { return epoch_; }

    // --- On the control thread alone.
    jobs::JobQueue& queue() { return queue_; }
    // A name that was made for the same, non-empty request_id is answered again.
    std::string CreateJob(const std::string& request_id, CheckedSpec spec);
    void CancelJob(const std::string& name);
    const CheckedSpec& SpecOf(const std::string& name) const { return records_.at(name).spec; }
    // `with_entries`: with the list of the scene's files.
    void FillJob(const jobs::JobInfo& info, bool with_entries, v1::Job* job) const;
    struct ResultFile {
        std::string id;
        std::uint64_t size = 0;
        std::string sha256;
    };
    // kFailedPrecondition unless the job has succeeded.
    ResultFile ResultOf(const std::string& name) const;

    void AddWorkerStream(Listener* listener) { worker_streams_.insert(listener); }
    void AddWatcher(Listener* listener) { watchers_.insert(listener); }
    void Remove(Listener* listener);
    std::size_t worker_stream_count() const { return worker_streams_.size(); }
    bool stopping() const { return stopping_; }
    // Call after whatever may have changed a job: starts plans and filters, gives leases out, tells
    // watchers.
    void Changed();
    // Tells all streams to end.
    void StopStreams();

  private:
    struct Record {
        CheckedSpec spec;
        v1::JobSpec brief;  // without the list of the scene's files, which may be long
        std::string request_id;
        std::string scene_sha256;
        std::string result_sha256;
        std::shared_ptr<CancelToken> cancel;
    };

    static void ForEach(const std::set<Listener*>& listeners, void (Listener::*call)());
    metrics::FarmStatus Status() const;
    void StartPlans();
    void StartFilters();
    double PredictFinish(const Film& film, const CheckedSpec& spec, const CancelToken& cancel);
    void Filter(const jobs::JobQueue::FilterWork& work, const CheckedSpec& spec,
                const std::string& numeric_class, const CancelToken& cancel);

    SteadyClock clock_;
    WallClock wall_{clock_.Now()};
    std::uint32_t epoch_;
    store::DataFolder folder_;
    store::BlobStore blobs_;
    store::ResultStore results_;
    FinishTimes finish_times_;
    Traffic traffic_;

    // Of the control thread.
    jobs::JobQueue queue_;
    std::map<std::string, Record> records_;           // by job
    std::map<std::string, std::string> request_ids_;  // to job
    std::set<Listener*> worker_streams_, watchers_;
    bool stopping_ = false;

    // Last, so that they end first: the others may still post to control.
    SerialExecutor control_{"control"};
    SerialExecutor io_{"io"};
    SerialExecutor plan_{"plan"};
    SerialExecutor filter_{"filter"};
};

// The part of a job's name behind "jobs/".
std::string JobId(const std::string& name);

}  // namespace relume::server
