#include "server/store/snapshot_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "tests/support/failing_disk.h"

namespace relume::store {
namespace {

using testing::ElementsAre;

class SnapshotStoreTest : public testing::Test {
  protected:
    SnapshotFile Write(const std::string& name, const std::vector<std::string>& records) {
        const auto writer = store.Begin(name);
        for (const auto& record : records) {
            writer->Add(record);
        }
        return writer->Commit();
    }
    std::vector<std::string> Read(const SnapshotFile& file) {
        std::vector<std::string> records;
        store.Read(file, [&](std::string record) { records.push_back(std::move(record)); });
        return records;
    }
    void ExpectLost(const SnapshotFile& file) {
        try {
            Read(file);
            ADD_FAILURE() << "was read";
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::kDataLoss) << error.what();
        }
    }
    std::size_t FileCount() {
        return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(Folder()),
                                                      std::filesystem::directory_iterator()));
    }
    std::filesystem::path Folder() { return folder.path() / "snapshots"; }

    TemporaryFolder folder;
    std::shared_ptr<test::FailingDisk> disk = std::make_shared<test::FailingDisk>();
    SnapshotStore store{folder.path() / "snapshots", disk};
};

TEST_F(SnapshotStoreTest, ReadsWhatWasWritten) {
    const std::string large(3 << 20, 'z');
    const SnapshotFile file = Write("a-1", {"first", "", large});
    EXPECT_EQ(file.size, 3 * 8 + 5 + large.size());
    EXPECT_THAT(Read(file), ElementsAre("first", "", large));
    EXPECT_EQ(FileCount(), 1u);
}

TEST_F(SnapshotStoreTest, TornOrDamagedOnesAreToldFromGoodOnes) {
    const SnapshotFile file = Write("a-1", {"first", std::string(1000, 'x')});
    const auto path = Folder() / "a-1";
    const std::string bytes = ReadFile(path);
    for (const std::size_t cut : {std::size_t{0}, std::size_t{7}, bytes.size() - 1}) {
        std::ofstream(path, std::ios::binary) << bytes.substr(0, cut);
        ExpectLost(file);
    }
    for (const std::size_t at :
         {std::size_t{0}, std::size_t{6}, std::size_t{9}, bytes.size() - 1}) {
        std::string damaged = bytes;
        damaged[at] = static_cast<char>(damaged[at] ^ 1);
        std::ofstream(path, std::ios::binary) << damaged;
        ExpectLost(file);
    }
    std::ofstream(path, std::ios::binary) << bytes;
    EXPECT_EQ(Read(file).size(), 2u);
    store.Remove("a-1");
    ExpectLost(file);
}

TEST_F(SnapshotStoreTest, WhatIsNotCommittedVanishes) {
    {
        const auto writer = store.Begin("a-1");
        writer->Add("record");
        EXPECT_EQ(FileCount(), 1u);
    }
    EXPECT_EQ(FileCount(), 0u);
}

TEST_F(SnapshotStoreTest, AFullDiskIsSaidAndLeavesNothingBehind) {
    const auto fill = [&] {
        const auto writer = store.Begin("a-1");
        disk->full = true;
        writer->Add("record");
        writer->Commit();
    };
    try {
        fill();
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kResourceExhausted);
    }
    EXPECT_EQ(FileCount(), 0u);
    EXPECT_THROW(store.Begin("a-2"), Error);
    disk->full = false;
    EXPECT_THAT(Read(Write("a-1", {"record"})), ElementsAre("record"));
}

TEST_F(SnapshotStoreTest, FilesThatNobodyKnowsAreCleared) {
    Write("a-1", {"x"});
    Write("a-2", {"x"});
    std::ofstream(Folder() / "a-3.new") << "left behind";
    store.RemoveOthers([](const std::string& name) { return name == "a-2"; });
    EXPECT_EQ(FileCount(), 1u);
    EXPECT_TRUE(std::filesystem::exists(Folder() / "a-2"));
}

TEST_F(SnapshotStoreTest, OnlyPlainNamesBecomeFiles) {
    for (const std::string& name : {std::string(), std::string("../x"), std::string("a/b"),
                                    std::string("a.b"), std::string(129, 'a')}) {
        EXPECT_THROW(store.Begin(name), Error) << name;
        EXPECT_THROW(store.Remove(name), Error) << name;
    }
}

}  // namespace
}  // namespace relume::store
