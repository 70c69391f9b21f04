#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/clock.h"
#include "core/base/error.h"
#include "server/jobs/job_queue.h"
#include "server/rpc/executor.h"
#include "server/rpc/job_message.h"
#include "server/store/ledger.h"
#include "server/store/snapshot_store.h"

namespace relume::server {

// Saves films while they are rendered, so that a server that dies costs no more than what came
// after the last save, and when all samples are in, so that a job can be extended. Merging goes on
// meanwhile: tiles are copied one by one (jobs::FilmCopy), as fast as a thread of their own writes
// them. No save
// begins before fifty times the seconds that the last one took are over, and none of a job that has
// not changed.
//
// All on the control thread, but for Load.
class FilmKeeper {
  public:
    struct Options {
        double save_seconds = 10;  // between saves of a job's film, at least; 0: none are saved
        std::uint64_t quota = std::uint64_t{16} << 30;  // bytes of films of jobs that are over
        // Bytes of copied tiles that wait to be written; copying goes on when they are fewer.
        std::size_t max_waiting_bytes = std::size_t{8} << 20;
    };
    struct Hooks {
        // Why a job can't go on; "": it can again.
        std::function<void(const std::string& job, const std::string& why)> hold;
        // A worker's answer is safe, or of no use.
        std::function<void(jobs::WorkerId, const std::string& ticket)> acknowledge;
    };
    FilmKeeper(const Options& options, Hooks hooks, jobs::JobQueue* queue, store::Ledger* ledger,
               store::SnapshotStore* store, const WallClock* wall, SerialExecutor* control,
               SerialExecutor* files);

    // The newest save of a job that can be read; damaged ones are told of and passed over. Nothing
    // if there is none. Its info has used `used_seconds` or more at `now`.
    std::optional<jobs::SavedJob> Load(const std::string& job, double used_seconds,
                                       TimePoint now) const;

    // A few times a second: begins a save that is due.
    void Tick(TimePoint now);
    // All samples of the job are in.
    void Final(const jobs::JobQueue::FilterWork& work);
    // The job is over: what its workers keep for it is of no use.
    void Over(const std::string& job);
    // An answer of a worker was merged, or waits to be. It is acknowledged when it is safe.
    void Answered(const std::string& job, std::uint64_t unit, jobs::WorkerId worker,
                  const std::string& ticket);
    // Saves all that has come since the last saves, one job after the other, due or not; then calls
    // `done`. A job whose plan is being made is waited for, by Tick. The server stops.
    void SaveAll(std::function<void()> done);
    // Gives the files thread no more work.
    void Stop() { stopped_ = true; }

    // The part of the name of a snapshot's file before its sequence.
    static std::string FilePrefix(const std::string& job);

  private:
    struct Answer {
        std::uint64_t unit;
        jobs::WorkerId worker;
        std::string ticket;
    };
    struct Kept {  // of one job under way
        TimePoint due;
        std::uint64_t samples = 0;  // in the film when it was saved last
        std::vector<Answer> answers;
        bool held = false;
    };
    // One save. The control thread's, but for what the files thread has after it was posted there.
    struct Save : std::enable_shared_from_this<Save> {
        std::string job;
        std::string header;
        jobs::Checkpoint checkpoint;  // when all tiles are copied
        bool final = false;
        std::size_t tiles_due = 0, tiles = 0;
        double control_seconds = 0;
        std::vector<Answer> answers;

        std::unique_ptr<store::SnapshotStore::Writer> writer;  // of the files thread, as the next
        std::optional<Error> error;
        std::uint64_t sequence = 0;
        double seconds = 0;
        std::uint64_t bytes = 0;
        std::atomic<std::size_t> waiting_bytes{0};
        std::atomic<bool> stalled{false};  // copying waits for the files thread
    };

    // False if the film can't be copied now.
    bool Begin(const std::string& job, Kept* kept, TimePoint now);
    bool Changed(const std::string& job, const Kept& kept) const;
    void SaveNext();
    void CopyMore(std::shared_ptr<Save> save);
    void Abandon(const std::string& job);
    void Post(const std::shared_ptr<Save>& save, std::function<void(Save*)> work);
    void Open(Save* save);
    void AddTile(Save* save, std::size_t tile, const std::string& bytes);
    void Commit(Save* save);
    void DropOldFilms();
    void Ended(const std::shared_ptr<Save>& save);

    Options options_;
    Hooks hooks_;
    jobs::JobQueue* queue_;
    store::Ledger* ledger_;
    store::SnapshotStore* store_;
    const WallClock* wall_;
    SerialExecutor* control_;
    SerialExecutor* files_;
    SteadyClock clock_;
    std::map<std::string, Kept> jobs_;
    std::shared_ptr<Save> copying_;     // of a job that renders
    std::vector<std::string> to_save_;  // by SaveAll, that is not done
    std::function<void()> all_saved_;   // unset: SaveAll was not called, or is done
    bool stopped_ = false;
    std::uint64_t sequence_ = 0;  // of the files thread
};

}  // namespace relume::server
