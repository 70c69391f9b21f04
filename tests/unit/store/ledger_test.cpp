#include "server/store/ledger.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <fstream>
#include <string>

#include "core/base/error.h"
#include "core/base/files.h"

namespace relume::store {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

JobRow Job(std::uint64_t number, const std::string& name) {
    JobRow job;
    job.number = number;
    job.name = name;
    job.request_id = "request-" + name;
    job.spec = std::string("spec\0with nul", 13);
    job.info = "info";
    return job;
}

SnapshotRow Snapshot(std::uint64_t sequence) {
    SnapshotRow row;
    row.sequence = sequence;
    row.file = {"a-" + std::to_string(sequence), 100 + sequence, std::string(64, 'a')};
    row.passes = {{0, 400, 4, 400, 4}, {1, 800, 8, 200, 2}};
    return row;
}

class LedgerTest : public testing::Test {
  protected:
    std::filesystem::path Path() const { return folder.path() / "state.db"; }
    TemporaryFolder folder;
};

TEST_F(LedgerTest, JobsAreThereAfterItIsOpenedAgain) {
    std::string secret;
    {
        Ledger ledger(Path());
        EXPECT_EQ(ledger.epoch(), 1u);
        secret = ledger.secret();
        EXPECT_EQ(secret.size(), 32u);
        ledger.Add(Job(1, "jobs/a"));
        ledger.Add(Job(2, "jobs/b"));
        JobRow over = Job(1, "jobs/a");
        over.over = true;
        over.result_sha256 = "1234";
        over.info = "ended";
        over.used_seconds = 2.5;
        ledger.Update(over);
        ledger.SetUsed({{"jobs/b", 1.25}, {"jobs/unknown", 3}});
    }
    Ledger ledger(Path());
    EXPECT_EQ(ledger.epoch(), 2u);
    EXPECT_EQ(ledger.secret(), secret);
    const auto jobs = ledger.Jobs();
    ASSERT_EQ(jobs.size(), 2u);
    EXPECT_EQ(jobs[0].name, "jobs/a");
    EXPECT_EQ(jobs[0].request_id, "request-jobs/a");
    EXPECT_EQ(jobs[0].spec, std::string("spec\0with nul", 13));
    EXPECT_EQ(jobs[0].info, "ended");
    EXPECT_EQ(jobs[0].result_sha256, "1234");
    EXPECT_EQ(jobs[0].used_seconds, 2.5);
    EXPECT_TRUE(jobs[0].over);
    EXPECT_EQ(jobs[1].number, 2u);
    EXPECT_EQ(jobs[1].used_seconds, 1.25);
    EXPECT_FALSE(jobs[1].over);
    EXPECT_THROW(ledger.Add(Job(3, "jobs/a")), Error);
}

TEST_F(LedgerTest, OnlyTheNewestSnapshotsCount) {
    Ledger ledger(Path());
    ledger.Add(Job(1, "jobs/a"));
    EXPECT_THAT(ledger.AddSnapshot("jobs/a", Snapshot(1), 2), IsEmpty());
    EXPECT_THAT(ledger.AddSnapshot("jobs/a", Snapshot(2), 2), IsEmpty());
    EXPECT_THAT(ledger.AddSnapshot("jobs/a", Snapshot(3), 2), ElementsAre("a-1"));
    const auto rows = ledger.Snapshots("jobs/a");
    ASSERT_EQ(rows.size(), 2u);
    EXPECT_EQ(rows[0].sequence, 3u);
    EXPECT_EQ(rows[0].file.name, "a-3");
    EXPECT_EQ(rows[0].file.size, 103u);
    ASSERT_EQ(rows[0].passes.size(), 2u);
    EXPECT_EQ(rows[0].passes[1].samples, 800u);
    EXPECT_EQ(rows[0].passes[1].merged_ranges, 2u);
    EXPECT_EQ(rows[1].sequence, 2u);
    EXPECT_THAT(ledger.SnapshotsOfThoseOver(), IsEmpty());
    JobRow over = Job(1, "jobs/a");
    over.over = true;
    ledger.Update(over);
    EXPECT_THAT(ledger.SnapshotsOfThoseOver(), ElementsAre(std::pair("jobs/a", 205u)));
    EXPECT_THAT(ledger.AddSnapshot("jobs/a", Snapshot(4), 1), ElementsAre("a-3", "a-2"));
    EXPECT_THAT(ledger.RemoveSnapshots("jobs/a"), ElementsAre("a-4"));
    EXPECT_THAT(ledger.Snapshots("jobs/a"), IsEmpty());
}

TEST_F(LedgerTest, WithAJobItsSnapshotsGo) {
    Ledger ledger(Path());
    ledger.Add(Job(1, "jobs/a"));
    ledger.AddSnapshot("jobs/a", Snapshot(1), 2);
    EXPECT_THAT(ledger.Remove("jobs/a"), ElementsAre("a-1"));
    EXPECT_THAT(ledger.Snapshots("jobs/a"), IsEmpty());
    EXPECT_THAT(ledger.Jobs(), IsEmpty());
    // One that was written when the job was forgotten.
    EXPECT_THAT(ledger.AddSnapshot("jobs/a", Snapshot(2), 2), ElementsAre("a-2"));
    EXPECT_THAT(ledger.Snapshots("jobs/a"), IsEmpty());
}

TEST_F(LedgerTest, IsWrittenAheadAndReadableAfterAKill) {
    Ledger ledger(Path());
    ledger.Add(Job(1, "jobs/a"));
    EXPECT_TRUE(std::filesystem::exists(Path().string() + "-wal"));
    // What a kill leaves: the files as they are, without a goodbye.
    const auto copy = folder.path() / "copy.db";
    std::filesystem::copy(Path(), copy);
    std::filesystem::copy(Path().string() + "-wal", copy.string() + "-wal");
    Ledger again(copy);
    EXPECT_EQ(again.epoch(), 2u);
    EXPECT_EQ(again.Jobs().size(), 1u);
}

TEST_F(LedgerTest, ATornTailOfTheLogLosesNoEarlierCommit) {
    const auto copy = folder.path() / "copy.db";
    {
        Ledger ledger(Path());
        ledger.Add(Job(1, "jobs/a"));
        ledger.Add(Job(2, "jobs/b"));
        std::filesystem::copy(Path(), copy);
        std::filesystem::copy(Path().string() + "-wal", copy.string() + "-wal");
    }
    const std::filesystem::path wal = copy.string() + "-wal";
    std::filesystem::resize_file(wal, std::filesystem::file_size(wal) - 100);
    Ledger ledger(copy);
    ASSERT_EQ(ledger.Jobs().size(), 1u);
    EXPECT_EQ(ledger.Jobs()[0].name, "jobs/a");
}

ErrorCode CodeOfOpening(const std::filesystem::path& path) {
    try {
        const Ledger ledger(path);
    } catch (const Error& error) {
        return error.code();
    }
    return ErrorCode::kInternal;
}

TEST_F(LedgerTest, OfANewerServerOrDamagedItIsRefused) {
    { const Ledger ledger(Path()); }
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(Path().c_str(), &db), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(db, "PRAGMA user_version = 99", nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(db);
    EXPECT_EQ(CodeOfOpening(Path()), ErrorCode::kFailedPrecondition);

    const auto other = folder.path() / "other.db";
    std::ofstream(other) << std::string(8192, 'x');
    EXPECT_EQ(CodeOfOpening(other), ErrorCode::kDataLoss);
    EXPECT_EQ(CodeOfOpening(folder.path() / "none" / "state.db"), ErrorCode::kFailedPrecondition);
}

TEST_F(LedgerTest, AFullDiskIsSaidAndChangesNothing) {
    Ledger ledger(Path());
    ledger.Add(Job(1, "jobs/a"));
    ledger.LimitPages(1);
    JobRow large = Job(2, "jobs/b");
    large.spec = std::string(100'000, 'x');
    try {
        ledger.Add(large);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kResourceExhausted) << error.what();
    }
    EXPECT_EQ(ledger.Jobs().size(), 1u);
    ledger.LimitPages(0);
    ledger.Add(large);
    EXPECT_EQ(ledger.Jobs().size(), 2u);
}

}  // namespace
}  // namespace relume::store
