#include "worker/loop/blob_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "core/base/files.h"
#include "tests/unit/loop/fake_blobs.h"

namespace relume::worker {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;

class BlobCacheTest : public testing::Test {
  protected:
    std::string Bytes(std::size_t size, char first) {
        std::string bytes(size, '\0');
        for (std::size_t i = 0; i < size; ++i) {
            bytes[i] = static_cast<char>(first + static_cast<char>(i * i % 41));
        }
        return bytes;
    }
    void Write(const std::string& name, const std::string& bytes) {
        std::ofstream(folder.path() / name, std::ios::binary) << bytes;
    }
    ErrorCode CodeOf(const std::function<void()>& body) {
        try {
            body();
        } catch (const Error& error) {
            return error.code();
        }
        ADD_FAILURE() << "nothing was thrown";
        return ErrorCode::kInternal;
    }
    // Makes a file look as if it was last used so long ago.
    void Age(const std::string& name, std::chrono::hours age) {
        fs::last_write_time(folder.path() / name, fs::file_time_type::clock::now() - age);
    }

    TemporaryFolder folder;
    FakeBlobs blobs;
    BlobCache cache{folder.path(), 1000};
};

TEST_F(BlobCacheTest, FetchesWhatItLacksOnce) {
    const std::string bytes = Bytes(250, 'a'), sha = blobs.Add(bytes);
    EXPECT_FALSE(cache.Has(sha));
    EXPECT_EQ(cache.Read(sha, bytes.size(), blobs.Fetch()), bytes);
    EXPECT_EQ(cache.Read(sha, bytes.size(), blobs.Fetch()), bytes);
    EXPECT_TRUE(cache.Has(sha));
    EXPECT_THAT(blobs.asked(), SizeIs(1));
    const std::string empty = blobs.Add("");
    EXPECT_EQ(cache.Read(empty, 0, blobs.Fetch()), "");
    // Another worker on the same folder.
    BlobCache other(folder.path(), 1000);
    EXPECT_EQ(other.Read(sha, bytes.size(), blobs.Fetch()), bytes);
    EXPECT_THAT(blobs.asked(), SizeIs(2));
}

TEST_F(BlobCacheTest, ABrokenTransferGoesOnWhereItWas) {
    const std::string bytes = Bytes(450, 'b'), sha = blobs.Add(bytes);
    blobs.BreakAfter({230, 300});
    const auto ensure = [&] { cache.Ensure(sha, bytes.size(), blobs.Fetch()); };
    EXPECT_EQ(CodeOf(ensure), ErrorCode::kUnavailable);
    EXPECT_EQ(CodeOf(ensure), ErrorCode::kUnavailable);
    EXPECT_FALSE(cache.Has(sha));
    ensure();
    EXPECT_EQ(cache.Read(sha, bytes.size(), blobs.Fetch()), bytes);
    EXPECT_THAT(blobs.asked(), ElementsAre(Pair(sha, 0), Pair(sha, 230), Pair(sha, 300)));
}

TEST_F(BlobCacheTest, OtherContentsLeaveNothing) {
    const std::string bytes = Bytes(120, 'c'), sha = blobs.Add(bytes);
    const auto ensure = [&] { cache.Ensure(sha, bytes.size(), blobs.Fetch()); };
    blobs.Corrupt(sha, Bytes(120, 'd'));
    EXPECT_EQ(CodeOf(ensure), ErrorCode::kDataLoss);
    blobs.Corrupt(sha, Bytes(121, 'c'));
    EXPECT_EQ(CodeOf(ensure), ErrorCode::kDataLoss);
    EXPECT_TRUE(fs::is_empty(folder.path()));
    blobs.Corrupt(sha, Bytes(100, 'c'));
    EXPECT_EQ(CodeOf(ensure), ErrorCode::kUnavailable);
    EXPECT_FALSE(cache.Has(sha));
    // A part that is not the blob's beginning spoils one transfer, which is made again.
    Write(sha + ".part", "nonsense");
    blobs.Corrupt(sha, bytes);
    ensure();
    EXPECT_TRUE(cache.Has(sha));
}

TEST_F(BlobCacheTest, WhatIsDamagedOnTheWayIsFetchedAgain) {
    const std::string bytes = Bytes(250, 'g'), sha = blobs.Add(bytes);
    const auto ensure = [&] { cache.Ensure(sha, bytes.size(), blobs.Fetch()); };
    blobs.Mangle(BlobCache::kFetchAttempts);
    EXPECT_EQ(CodeOf(ensure), ErrorCode::kDataLoss);
    EXPECT_TRUE(fs::is_empty(folder.path()));
    EXPECT_THAT(blobs.asked(), SizeIs(BlobCache::kFetchAttempts));
    blobs.Mangle(BlobCache::kFetchAttempts - 1);
    ensure();
    EXPECT_EQ(cache.Read(sha, bytes.size(), blobs.Fetch()), bytes);
    EXPECT_THAT(blobs.asked(), SizeIs(2 * BlobCache::kFetchAttempts));
}

TEST_F(BlobCacheTest, AFileThatDecayedIsFetchedAgain) {
    const std::string bytes = Bytes(200, 'e'), sha = blobs.Add(bytes);
    cache.Ensure(sha, bytes.size(), blobs.Fetch());
    Write(sha, Bytes(200, 'f'));
    EXPECT_EQ(cache.Read(sha, bytes.size(), blobs.Fetch()), bytes);
    Write(sha, Bytes(10, 'e'));
    EXPECT_EQ(cache.Read(sha, bytes.size(), blobs.Fetch()), bytes);
    EXPECT_THAT(blobs.asked(), SizeIs(3));
}

TEST_F(BlobCacheTest, TheLeastRecentlyUsedGoFirst) {
    std::vector<std::string> sha;
    for (char c = 'a'; c < 'd'; ++c) {
        sha.push_back(blobs.Add(Bytes(300, c)));
        cache.Ensure(sha.back(), 300, blobs.Fetch());
        Age(sha.back(), std::chrono::hours(10 - (c - 'a')));
    }
    cache.Ensure(sha[0], 300, blobs.Fetch());  // used just now
    Write("unfinished.part", Bytes(50, 'x'));  // of a process that died long ago
    Age("unfinished.part", std::chrono::hours(100));
    const std::string next = blobs.Add(Bytes(400, 'z'));
    cache.Ensure(next, 400, blobs.Fetch());
    EXPECT_TRUE(cache.Has(sha[0]));
    EXPECT_FALSE(cache.Has(sha[1]));
    EXPECT_TRUE(cache.Has(next));
    EXPECT_FALSE(fs::exists(folder.path() / "unfinished.part"));
    // One that is larger than the cache is kept while it is needed.
    const std::string huge = blobs.Add(Bytes(2000, 'h'));
    cache.Ensure(huge, 2000, blobs.Fetch());
    EXPECT_TRUE(cache.Has(huge));
    EXPECT_FALSE(cache.Has(next));
}

TEST_F(BlobCacheTest, OnlyDigestsBecomeFileNames) {
    for (const char* name : {"../evil", "", "ABCD", "/etc/passwd"}) {
        EXPECT_EQ(CodeOf([&] { cache.Ensure(name, 1, blobs.Fetch()); }),
                  ErrorCode::kInvalidArgument);
    }
    EXPECT_THAT(blobs.asked(), IsEmpty());
}

TEST_F(BlobCacheTest, ManyThreadsAndTwoCachesFetchOnce) {
    const std::string bytes = Bytes(900, 'm'), sha = blobs.Add(bytes);
    BlobCache other(folder.path(), 1000);
    std::vector<std::thread> threads;
    for (int i = 0; i < 8; ++i) {
        threads.emplace_back([&, i] {
            EXPECT_EQ((i % 2 == 0 ? cache : other).Read(sha, bytes.size(), blobs.Fetch()), bytes);
        });
    }
    for (auto& thread : threads) {
        thread.join();
    }
    EXPECT_THAT(blobs.asked(), SizeIs(1));
}

TEST_F(BlobCacheTest, AFolderThatCannotBeIsSaid) {
    Write("file", "");
    EXPECT_EQ(CodeOf([&] { BlobCache(folder.path() / "file" / "cache", 1); }),
              ErrorCode::kFailedPrecondition);
}

}  // namespace
}  // namespace relume::worker
