#include "server/store/ledger.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <exception>
#include <limits>
#include <random>
#include <utility>

#include "core/base/error.h"

namespace relume::store {
namespace {

// Raised with each change of the tables; older files are brought up to date when they are opened.
constexpr int kSchema = 1;

constexpr const char* kTables = R"(
CREATE TABLE meta (key TEXT PRIMARY KEY, value BLOB NOT NULL) WITHOUT ROWID;
CREATE TABLE jobs (
    number INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    request_id TEXT NOT NULL,
    spec BLOB NOT NULL,
    info BLOB NOT NULL,
    result_sha256 TEXT NOT NULL,
    over INTEGER NOT NULL,
    used_seconds REAL NOT NULL
);
CREATE TABLE snapshots (
    job TEXT NOT NULL REFERENCES jobs (name) ON DELETE CASCADE,
    sequence INTEGER NOT NULL,
    file TEXT NOT NULL,
    size INTEGER NOT NULL,
    sha256 TEXT NOT NULL,
    PRIMARY KEY (job, sequence)
) WITHOUT ROWID;
CREATE TABLE ranges (
    job TEXT NOT NULL,
    sequence INTEGER NOT NULL,
    pass INTEGER NOT NULL,
    samples INTEGER NOT NULL,
    ranges INTEGER NOT NULL,
    merged_samples INTEGER NOT NULL,
    merged_ranges INTEGER NOT NULL,
    PRIMARY KEY (job, sequence, pass),
    FOREIGN KEY (job, sequence) REFERENCES snapshots (job, sequence) ON DELETE CASCADE
) WITHOUT ROWID;
)";

}  // namespace

// A statement that is prepared, bound in order, stepped and read in order.
class Ledger::Statement {
  public:
    Statement(const Ledger* ledger, const char* sql) : ledger_(ledger) {
        if (sqlite3_prepare_v2(ledger_->db_, sql, -1, &statement_, nullptr) != SQLITE_OK) {
            ledger_->Throw("read");
        }
    }
    ~Statement() { sqlite3_finalize(statement_); }
    Statement(const Statement&) = delete;
    Statement& operator=(const Statement&) = delete;

    Statement& Bind(std::uint64_t value) {
        return Check(sqlite3_bind_int64(statement_, ++bound_, static_cast<sqlite3_int64>(value)));
    }
    Statement& Bind(double value) {
        return Check(sqlite3_bind_double(statement_, ++bound_, value));
    }
    Statement& Bind(const std::string& text) {
        return Check(sqlite3_bind_text64(statement_, ++bound_, text.data(), text.size(),
                                         SQLITE_TRANSIENT, SQLITE_UTF8));
    }
    Statement& BindBytes(const std::string& bytes) {
        return Check(sqlite3_bind_blob64(statement_, ++bound_, bytes.data(), bytes.size(),
                                         SQLITE_TRANSIENT));
    }
    // True if there is a row.
    bool Step() {
        read_ = 0;
        const int result = sqlite3_step(statement_);
        if (result != SQLITE_ROW && result != SQLITE_DONE) {
            ledger_->Throw("write");
        }
        return result == SQLITE_ROW;
    }
    std::uint64_t Number() {
        return static_cast<std::uint64_t>(sqlite3_column_int64(statement_, read_++));
    }
    double Real() { return sqlite3_column_double(statement_, read_++); }
    std::string Bytes() {
        const int column = read_++;
        const void* bytes = sqlite3_column_blob(statement_, column);
        const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
        return bytes == nullptr ? std::string()
                                : std::string(static_cast<const char*>(bytes), size);
    }

  private:
    Statement& Check(int result) {
        if (result != SQLITE_OK) {
            ledger_->Throw("write");
        }
        return *this;
    }

    const Ledger* ledger_;
    sqlite3_stmt* statement_ = nullptr;
    int bound_ = 0, read_ = 0;
};

// Rolled back unless Commit was called.
class Ledger::Transaction {
  public:
    explicit Transaction(const Ledger* ledger) : ledger_(ledger) {
        ledger_->Execute("BEGIN IMMEDIATE");
    }
    ~Transaction() {
        if (open_ && sqlite3_get_autocommit(ledger_->db_) == 0) {
            sqlite3_exec(ledger_->db_, "ROLLBACK", nullptr, nullptr, nullptr);
        }
    }
    Transaction(const Transaction&) = delete;
    Transaction& operator=(const Transaction&) = delete;

    void Commit() {
        ledger_->Execute("COMMIT");
        open_ = false;
    }

  private:
    const Ledger* ledger_;
    bool open_ = true;
};

void Ledger::Throw(const char* doing) const {
    const int error = db_ == nullptr ? SQLITE_NOMEM : sqlite3_errcode(db_);
    const std::string said = db_ == nullptr ? "out of memory" : sqlite3_errmsg(db_);
    switch (error & 0xff) {
        case SQLITE_FULL:
            throw Error(ErrorCode::kResourceExhausted,
                        fmt::format("{}: can't {}: {}; free some space on the server",
                                    path_.string(), doing, said));
        case SQLITE_CORRUPT:
        case SQLITE_NOTADB:
            throw Error(ErrorCode::kDataLoss,
                        fmt::format("{}: {}; put back a copy of it, or move it away: results stay, "
                                    "jobs are forgotten",
                                    path_.string(), said));
        default:
            throw Error(ErrorCode::kFailedPrecondition,
                        fmt::format("{}: can't {}: {}; check the server's --data folder",
                                    path_.string(), doing, said));
    }
}

void Ledger::Execute(const char* sql) const {
    if (sqlite3_exec(db_, sql, nullptr, nullptr, nullptr) != SQLITE_OK) {
        Throw("write");
    }
}

Ledger::Ledger(const std::filesystem::path& path) : path_(path) {
    try {
        if (sqlite3_open_v2(path.c_str(), &db_,
                            SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX,
                            nullptr) != SQLITE_OK) {
            Throw("open");
        }
        sqlite3_busy_timeout(db_, 5000);
        Execute("PRAGMA foreign_keys = ON");
        Execute("PRAGMA journal_mode = WAL");
        Execute("PRAGMA synchronous = FULL");
        Transaction transaction(this);
        Statement version(this, "PRAGMA user_version");
        version.Step();
        const auto schema = static_cast<int>(version.Number());
        if (schema > kSchema) {
            throw Error(ErrorCode::kFailedPrecondition,
                        fmt::format("{}: was written by a newer relume-server (schema {}, this one "
                                    "knows {}); use that one, or another --data",
                                    path.string(), schema, kSchema));
        }
        if (schema == 0) {
            Execute(kTables);
            Execute(fmt::format("PRAGMA user_version = {}", kSchema).c_str());
            std::random_device random;
            std::string secret;
            for (int i = 0; i < 32; ++i) {
                secret += static_cast<char>(random() & 0xff);
            }
            Statement(this, "INSERT INTO meta VALUES ('secret', ?), ('epoch', 0)")
                .BindBytes(secret)
                .Step();
        }
        Execute("UPDATE meta SET value = value + 1 WHERE key = 'epoch'");
        Statement meta(this, "SELECT value FROM meta ORDER BY key");  // epoch, secret
        meta.Step();
        epoch_ = static_cast<std::uint32_t>(meta.Number());
        meta.Step();
        secret_ = meta.Bytes();
        transaction.Commit();
    } catch (...) {
        sqlite3_close_v2(db_);
        throw;
    }
}

Ledger::~Ledger() { sqlite3_close_v2(db_); }

void Ledger::Add(const JobRow& job) {
    const std::lock_guard lock(mutex_);
    Statement(this, "INSERT INTO jobs VALUES (?, ?, ?, ?, ?, ?, ?, ?)")
        .Bind(job.number)
        .Bind(job.name)
        .Bind(job.request_id)
        .BindBytes(job.spec)
        .BindBytes(job.info)
        .Bind(job.result_sha256)
        .Bind(std::uint64_t{job.over})
        .Bind(job.used_seconds)
        .Step();
}

void Ledger::Update(const JobRow& job) {
    const std::lock_guard lock(mutex_);
    Statement(this,
              "UPDATE jobs SET spec = ?, info = ?, result_sha256 = ?, over = ?, used_seconds = ? "
              "WHERE name = ?")
        .BindBytes(job.spec)
        .BindBytes(job.info)
        .Bind(job.result_sha256)
        .Bind(std::uint64_t{job.over})
        .Bind(job.used_seconds)
        .Bind(job.name)
        .Step();
}

void Ledger::SetUsed(const std::vector<std::pair<std::string, double>>& used_seconds) {
    const std::lock_guard lock(mutex_);
    Transaction transaction(this);
    for (const auto& [name, seconds] : used_seconds) {
        Statement(this, "UPDATE jobs SET used_seconds = ? WHERE name = ?")
            .Bind(seconds)
            .Bind(name)
            .Step();
    }
    transaction.Commit();
}

std::vector<JobRow> Ledger::Jobs() const {
    const std::lock_guard lock(mutex_);
    Statement query(this,
                    "SELECT number, name, request_id, spec, info, result_sha256, over, "
                    "used_seconds FROM jobs ORDER BY number");
    std::vector<JobRow> jobs;
    while (query.Step()) {
        JobRow& job = jobs.emplace_back();
        job.number = query.Number();
        job.name = query.Bytes();
        job.request_id = query.Bytes();
        job.spec = query.Bytes();
        job.info = query.Bytes();
        job.result_sha256 = query.Bytes();
        job.over = query.Number() != 0;
        job.used_seconds = query.Real();
    }
    return jobs;
}

std::vector<std::string> Ledger::FilesOf(const std::string& job) const {
    Statement query(this, "SELECT file FROM snapshots WHERE job = ?");
    query.Bind(job);
    std::vector<std::string> files;
    while (query.Step()) {
        files.push_back(query.Bytes());
    }
    return files;
}

std::vector<std::string> Ledger::Remove(const std::string& job) {
    const std::lock_guard lock(mutex_);
    Transaction transaction(this);
    const auto files = FilesOf(job);
    Statement(this, "DELETE FROM jobs WHERE name = ?").Bind(job).Step();
    transaction.Commit();
    return files;
}

void Ledger::DeleteSnapshots(const std::string& job, std::uint64_t below) {
    Statement(this, "DELETE FROM snapshots WHERE job = ? AND sequence < ?")
        .Bind(job)
        .Bind(below)
        .Step();
}

std::vector<std::string> Ledger::AddSnapshot(const std::string& job, const SnapshotRow& row,
                                             int keep) {
    const std::lock_guard lock(mutex_);
    Transaction transaction(this);
    Statement known(this, "SELECT 1 FROM jobs WHERE name = ?");
    if (!known.Bind(job).Step()) {
        return {row.file.name};
    }
    Statement(this, "INSERT INTO snapshots VALUES (?, ?, ?, ?, ?)")
        .Bind(job)
        .Bind(row.sequence)
        .Bind(row.file.name)
        .Bind(row.file.size)
        .Bind(row.file.sha256)
        .Step();
    for (const PassRow& pass : row.passes) {
        Statement(this, "INSERT INTO ranges VALUES (?, ?, ?, ?, ?, ?, ?)")
            .Bind(job)
            .Bind(row.sequence)
            .Bind(std::uint64_t{pass.pass})
            .Bind(pass.samples)
            .Bind(pass.ranges)
            .Bind(pass.merged_samples)
            .Bind(pass.merged_ranges)
            .Step();
    }
    Statement old(this,
                  "SELECT sequence, file FROM snapshots WHERE job = ? ORDER BY sequence DESC "
                  "LIMIT -1 OFFSET ?");
    old.Bind(job).Bind(static_cast<std::uint64_t>(keep));
    std::vector<std::string> files;
    std::uint64_t below = 0;
    while (old.Step()) {
        below = std::max(below, old.Number() + 1);
        files.push_back(old.Bytes());
    }
    DeleteSnapshots(job, below);
    transaction.Commit();
    return files;
}

std::vector<SnapshotRow> Ledger::Snapshots(const std::string& job) const {
    const std::lock_guard lock(mutex_);
    Statement query(this,
                    "SELECT sequence, file, size, sha256 FROM snapshots WHERE job = ? ORDER BY "
                    "sequence DESC");
    query.Bind(job);
    std::vector<SnapshotRow> rows;
    while (query.Step()) {
        SnapshotRow& row = rows.emplace_back();
        row.sequence = query.Number();
        row.file.name = query.Bytes();
        row.file.size = query.Number();
        row.file.sha256 = query.Bytes();
        Statement passes(this,
                         "SELECT pass, samples, ranges, merged_samples, merged_ranges FROM ranges "
                         "WHERE job = ? AND sequence = ? ORDER BY pass");
        passes.Bind(job).Bind(row.sequence);
        while (passes.Step()) {
            PassRow& pass = row.passes.emplace_back();
            pass.pass = static_cast<std::uint32_t>(passes.Number());
            pass.samples = passes.Number();
            pass.ranges = passes.Number();
            pass.merged_samples = passes.Number();
            pass.merged_ranges = passes.Number();
        }
    }
    return rows;
}

std::vector<std::pair<std::string, std::uint64_t>> Ledger::SnapshotsOfThoseOver() const {
    const std::lock_guard lock(mutex_);
    Statement query(this,
                    "SELECT name, sum(size) FROM jobs JOIN snapshots ON job = name WHERE over "
                    "GROUP BY name ORDER BY number");
    std::vector<std::pair<std::string, std::uint64_t>> list;
    while (query.Step()) {
        std::string name = query.Bytes();
        list.emplace_back(std::move(name), query.Number());
    }
    return list;
}

std::vector<std::string> Ledger::RemoveSnapshots(const std::string& job) {
    const std::lock_guard lock(mutex_);
    Transaction transaction(this);
    const auto files = FilesOf(job);
    DeleteSnapshots(job, std::numeric_limits<std::int64_t>::max());
    transaction.Commit();
    return files;
}

void Ledger::LimitPages(std::uint64_t pages) {
    const std::lock_guard lock(mutex_);
    Execute(fmt::format("PRAGMA max_page_count = {}", pages == 0 ? 0xfffffffe : pages).c_str());
}

}  // namespace relume::store
