#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/store/snapshot_store.h"

struct sqlite3;

namespace relume::store {

// A job as the ledger keeps it; what `spec` and `info` hold is the caller's matter.
struct JobRow {
    std::uint64_t number = 0;
    std::string name;
    std::string request_id;  // "": none
    std::string spec, info;
    std::string result_sha256;  // of its file; "": none yet
    bool over = false;
    double used_seconds = 0;  // of its time limit
};

// What of a pass is in a snapshot.
struct PassRow {
    std::uint32_t pass = 0;
    std::uint64_t samples = 0, ranges = 0;  // planned
    std::uint64_t merged_samples = 0, merged_ranges = 0;
};

struct SnapshotRow {
    std::uint64_t sequence = 0;  // rises with each of the job's
    SnapshotFile file;
    std::vector<PassRow> passes;
};

// The books of the server, in a file of SQLite's (write-ahead log, synced at each commit): jobs,
// which snapshots of them count, and which ranges of samples are in those. Each call is one
// transaction: after a crash it was done or not. Failures are Errors: kResourceExhausted for a full
// disk, kDataLoss for a damaged file, kFailedPrecondition for others. Thread-safe.
class Ledger {
  public:
    explicit Ledger(const std::filesystem::path& path);
    ~Ledger();
    Ledger(const Ledger&) = delete;
    Ledger& operator=(const Ledger&) = delete;

    // How often the file was opened, this time included: rises with each start of the server.
    std::uint32_t epoch() const { return epoch_; }
    // 32 random bytes, the same for the file's life.
    const std::string& secret() const { return secret_; }

    void Add(const JobRow& job);
    // All but name, number and request_id, of a job that is there; else nothing.
    void Update(const JobRow& job);
    void SetUsed(const std::vector<std::pair<std::string, double>>& used_seconds);
    std::vector<JobRow> Jobs() const;  // by number
    // With its snapshots; names of their files, which can go.
    std::vector<std::string> Remove(const std::string& job);

    // Makes a snapshot count, and all but the newest `keep` of the job's not. Names of the files
    // that can go; all of them, this one included, if the job is not there.
    std::vector<std::string> AddSnapshot(const std::string& job, const SnapshotRow& row, int keep);
    // Those of a job that count, newest first.
    std::vector<SnapshotRow> Snapshots(const std::string& job) const;
    // As above, of jobs that are over: their names, and the bytes of their files, oldest first.
    std::vector<std::pair<std::string, std::uint64_t>> SnapshotsOfThoseOver() const;
    std::vector<std::string> RemoveSnapshots(const std::string& job);

    // As much room as SQLite's file may take, in its pages, for tests of full disks; 0: any.
    void LimitPages(std::uint64_t pages);

  private:
    class Statement;
    class Transaction;
    void Execute(const char* sql) const;
    [[noreturn]] void Throw(const char* doing) const;
    std::vector<std::string> FilesOf(const std::string& job) const;
    void DeleteSnapshots(const std::string& job, std::uint64_t below);

    std::filesystem::path path_;
    std::uint32_t epoch_ = 0;
    std::string secret_;
    mutable std::mutex mutex_;  // guards db_
    sqlite3* db_ = nullptr;
};

}  // namespace relume::store
