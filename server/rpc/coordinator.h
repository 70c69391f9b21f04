#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/cancel_token.h"
#include "core/base/clock.h"
#include "server/jobs/job_queue.h"
#include "server/metrics/farm_status.h"
#include "server/rpc/executor.h"
#include "server/rpc/film_keeper.h"
#include "server/rpc/finish_image.h"
#include "server/rpc/finish_times.h"
#include "server/rpc/job_message.h"
#include "server/rpc/job_spec.h"
#include "server/rpc/quotas.h"
#include "server/rpc/traffic.h"
#include "server/store/blob_store.h"
#include "server/store/data_folder.h"
#include "server/store/disk.h"
#include "server/store/ledger.h"
#include "server/store/result_store.h"
#include "server/store/snapshot_store.h"

namespace relume::server {

struct CoordinatorOptions {
    std::filesystem::path data;  // holds blobs, results, films, the ledger and a lock
    std::uint64_t blob_quota = std::uint64_t{64} << 30;
    FilmKeeper::Options films;
    double cross_check = 0;  // share of units that two workers render, see JobQueue
    double silent_seconds = jobs::kSilentSeconds;  // then a worker is taken for gone
    Quotas quotas;
    std::shared_ptr<store::Disk> disk = store::RealDisk();  // for results and films
};

// An open stream that wants to hear of changes. Called on the control thread.
class Listener {
  public:
    virtual ~Listener() = default;
    // Something may have changed: send what there is to send.
    virtual void Advance() = 0;
    // The server is going to stop.
    virtual void Stop() = 0;
    // Tells the queue if something has been received that waits to be handled.
    virtual void NoteReceived() {}
};

// What the services share: the queue of jobs, the store, and the threads that work on them. The
// control thread owns all state of jobs and workers; the io thread reads and writes files; the
// plan thread plans passes, the filter thread finishes images, the books thread writes the ledger,
// the films thread saves films, one at a time each. Services post their work there and answer from
// there.
//
// What an earlier server left in the data folder goes on: jobs that were queued, rendered or
// filtered, and results.
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
    const WallClock& wall() const { return wall_; }
    Traffic& traffic() { return traffic_; }  // thread-safe
    // What is seen from outside. Thread-safe; waits for the control thread, in vain if that does
    // not come to it within seconds.
    std::optional<metrics::FarmStatus> AskStatus();
    // Rises with every start of the server. Leases of an earlier one are unknown, their answers are
    // taken by their tickets.
    std::uint32_t epoch() const { return ledger_.epoch(); }
    const std::string& secret() const { return ledger_.secret(); }  // of tickets

    // Throws kResourceExhausted if the image is larger than the server wants any to be.
    void CheckSize(const CheckedSpec& spec) const;

    // --- On the control thread alone.
    jobs::JobQueue& queue() { return queue_; }
    // Called on the control thread: with why it could not be done, or nothing.
    using Done = std::function<void(const std::optional<Error>& why)>;
    // A name that was made for the same, non-empty request_id is answered again. `done` when the
    // job is on the disk. Throws kResourceExhausted beyond a quota.
    std::string CreateJob(const std::string& request_id, CheckedSpec spec, Done done);
    // As JobQueue's calls of those names; `discard`: no image is made of what is there.
    void CancelJob(const std::string& name, bool discard, Done done);
    void PauseJob(const std::string& name, Done done);
    void ResumeJob(const std::string& name, Done done);
    void UpdateJob(const std::string& name, std::optional<int> priority, Done done);
    // Goes on with a job that has an image, to `spp` samples a pixel.
    void ExtendJob(const std::string& name, double spp, Done done);
    const CheckedSpec& SpecOf(const std::string& name) const { return records_.at(name).spec; }
    // codec::TaskDigest of what a worker is lent of the job.
    std::uint64_t TaskDigest(const std::string& name, std::uint64_t unit,
                             const TileTask& task) const;
    // `with_entries`: with the list of the scene's files.
    void FillJob(const jobs::JobInfo& info, bool with_entries, v1::Job* job) const;
    struct ResultFile {
        std::string id;
        std::uint64_t size = 0;
        std::string sha256;
    };
    // kFailedPrecondition unless the job has an image.
    ResultFile ResultOf(const std::string& name) const;

    // An answer was merged.
    void Answered(const std::string& job, std::uint64_t unit, jobs::WorkerId worker,
                  const std::string& ticket) {
        keeper_.Answered(job, unit, worker, ticket);
    }
    // Tickets of the worker's that are to be acknowledged, since the last call.
    void Acknowledge(jobs::WorkerId worker, const std::string& ticket);
    std::vector<std::string> TakeAcknowledged(jobs::WorkerId worker);

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
    // After that: saves what has come in since the last saves, then calls `done`.
    void SaveFilms(const std::function<void()>& done);

  private:
    struct Record {
        CheckedSpec spec;
        v1::JobSpec brief;  // without the list of the scene's files, which may be long
        std::string request_id;
        std::string scene_sha256;
        std::uint64_t context_digest = 0;  // of what workers are told of it
        std::string result_sha256;
        std::shared_ptr<CancelToken> cancel;
        bool over = false;      // on the disk
        std::string caller;     // for quotas
        std::size_t bytes = 0;  // of the request
    };
    // An image that waits to be stored.
    struct Unstored {
        std::string name;
        std::shared_ptr<const FinishedImage> image;
        TimePoint due;
    };

    // Throws kResourceExhausted if the caller, or all together, have too many jobs that are not
    // over to get one more whose request has so many bytes.
    void CheckQuotas(const std::string& caller, std::size_t bytes) const;
    // Forgets the oldest jobs that are over if there are too many, or their requests too large.
    void ForgetOldJobs();

    void Load();
    void LoadJob(const store::JobRow& row);
    Record* AddRecord(const std::string& name, const std::string& request_id, CheckedSpec spec);
    jobs::JobSetup SetupOf(const CheckedSpec& spec, const std::shared_ptr<CancelToken>& cancel);
    // The job as the ledger is to have it, with `info`.
    store::JobRow RowOf(const jobs::JobInfo& info) const;
    // Writes it, on the books thread.
    void Write(const store::JobRow& row, bool fresh, Done done);
    void Forget(const std::string& name);
    void Extend(const std::string& name, CheckedSpec spec, jobs::SavedJob film, const Done& done);
    void Hold(const std::string& name, const std::string& why);
    void Tick();
    void NoteThoseOver();
    void NoteUsedTime(TimePoint now);
    void StoreImage(const std::string& name, std::shared_ptr<const FinishedImage> image);
    void Stored(const std::string& name, const std::shared_ptr<const FinishedImage>& image);
    void NotStored(const std::string& name, std::shared_ptr<const FinishedImage> image,
                   const std::string& why);
    static void ForEach(const std::set<Listener*>& listeners, void (Listener::*call)());
    metrics::FarmStatus Status() const;
    void StartPlans();
    void StartFilters();
    double PredictFinish(const Film& film, const CheckedSpec& spec, const CancelToken& cancel);
    void Filter(const jobs::JobQueue::FilterWork& work, const CheckedSpec& spec,
                const std::string& numeric_class, const CancelToken& cancel);

    const Quotas quotas_;
    SteadyClock clock_;
    WallClock wall_{clock_.Now()};
    store::DataFolder folder_;
    std::shared_ptr<store::Disk> disk_;
    store::Ledger ledger_;
    store::SnapshotStore snapshots_;
    store::BlobStore blobs_;
    store::ResultStore results_;
    FinishTimes finish_times_;
    Traffic traffic_;

    // Of the control thread.
    jobs::JobQueue queue_;
    std::map<std::string, Record> records_;           // by job
    std::map<std::string, std::string> request_ids_;  // to job
    std::set<Listener*> worker_streams_, watchers_;
    std::map<jobs::WorkerId, std::vector<std::string>> acknowledged_;
    std::vector<Unstored> unstored_;
    std::deque<jobs::JobQueue::FilterWork> to_filter_;
    bool planning_ = false, filtering_ = false;  // on their threads
    TimePoint used_noted_;
    bool stopping_ = false;
    FilmKeeper keeper_;

    // Last, so that they end first: the others may still post to control.
    SerialExecutor control_{"control"};
    SerialExecutor io_{"io"};
    SerialExecutor plan_{"plan"};
    SerialExecutor filter_{"filter"};
    SerialExecutor books_{"books"};
    SerialExecutor films_{"films", SerialExecutor::kBackground};
};

// The part of a job's name behind "jobs/".
std::string JobId(const std::string& name);

}  // namespace relume::server
