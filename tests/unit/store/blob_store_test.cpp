#include "server/store/blob_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"

namespace relume::store {
namespace {

using testing::HasSubstr;

constexpr std::uint64_t kQuota = 1 << 20;

template <typename F>
void ExpectError(ErrorCode code, const std::string& said, F&& f) {
    try {
        f();
        FAIL() << "no error; expected: " << said;
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), code) << error.what();
        EXPECT_THAT(error.what(), HasSubstr(said));
    }
}

class BlobStoreTest : public testing::Test {
  protected:
    std::string Put(const std::string& bytes) {
        const std::string sha256 = Sha256Hex(bytes);
        auto upload = store.Begin(sha256, bytes.size(), 0);
        upload->Append(bytes);
        upload->Commit();
        return sha256;
    }
    std::size_t Files() const {
        std::size_t files = 0;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.path())) {
            files += entry.is_regular_file() ? 1 : 0;
        }
        return files;
    }

    TemporaryFolder folder;
    BlobStore store{folder.path(), kQuota};
};

TEST_F(BlobStoreTest, KeepsWhatItWasGiven) {
    const std::string bytes(100'000, 'x');
    const std::string sha256 = Put(bytes);
    EXPECT_TRUE(store.Has(sha256));
    EXPECT_EQ(store.SizeOf(sha256), bytes.size());
    EXPECT_EQ(store.used(), bytes.size());
    EXPECT_EQ(store.Read(sha256, 99'990, 100), std::string(10, 'x'));
    EXPECT_EQ(store.Read(sha256, 100'000, 100), "");
    EXPECT_EQ(store.PartSize(sha256), 0u);
    const std::string empty = Put("");
    EXPECT_TRUE(store.Has(empty));
    EXPECT_EQ(store.SizeOf(empty), 0u);
}

TEST_F(BlobStoreTest, ABrokenUploadGoesOnWhereItWas) {
    const std::string bytes = "all that is gold does not glitter";
    const std::string sha256 = Sha256Hex(bytes);
    {
        auto upload = store.Begin(sha256, bytes.size(), 0);
        upload->Append(bytes.substr(0, 10));
    }
    EXPECT_FALSE(store.Has(sha256));
    EXPECT_EQ(store.PartSize(sha256), 10u);
    EXPECT_EQ(store.used(), 10u);
    // Also from before the end of what is there, as after a lost answer, and by the next server on
    // the folder.
    BlobStore later(folder.path(), kQuota);
    EXPECT_EQ(later.used(), 10u);
    auto upload = later.Begin(sha256, bytes.size(), 7);
    EXPECT_EQ(upload->offset(), 7u);
    upload->Append(bytes.substr(7));
    EXPECT_TRUE(upload->complete());
    upload->Commit();
    upload.reset();
    EXPECT_EQ(later.Read(sha256, 0, 100), bytes);
    EXPECT_EQ(later.used(), bytes.size());
    EXPECT_EQ(Files(), 1u);
}

TEST_F(BlobStoreTest, AnotherDigestLeavesNothing) {
    const std::string sha256 = Sha256Hex("promised");
    auto upload = store.Begin(sha256, 8, 0);
    upload->Append("given...");
    ExpectError(ErrorCode::kDataLoss, sha256, [&] { upload->Commit(); });
    upload.reset();
    EXPECT_FALSE(store.Has(sha256));
    EXPECT_EQ(Files(), 0u);
    EXPECT_EQ(store.used(), 0u);
}

TEST_F(BlobStoreTest, OffsetsAndSizesThatDoNotFitAreRefused) {
    const std::string sha256 = Sha256Hex("promised");
    ExpectError(ErrorCode::kInvalidArgument, "goes on at byte 0",
                [&] { store.Begin(sha256, 8, 3); });
    auto upload = store.Begin(sha256, 8, 0);
    upload->Append("promis");
    ExpectError(ErrorCode::kInvalidArgument, "more than the 8 bytes",
                [&] { upload->Append("ed!"); });
    upload.reset();
    EXPECT_EQ(store.used(), 0u) << "nothing of it is kept";
    upload = store.Begin(sha256, 8, 0);
    upload->Append("promised");
    upload->Commit();
    EXPECT_TRUE(store.Has(sha256));
}

TEST_F(BlobStoreTest, OneUploadOfABlobAtATime) {
    const std::string sha256 = Sha256Hex("promised");
    auto upload = store.Begin(sha256, 8, 0);
    ExpectError(ErrorCode::kUnavailable, "try again", [&] { store.Begin(sha256, 8, 0); });
    upload.reset();
    EXPECT_NO_THROW(store.Begin(sha256, 8, 0));
}

TEST_F(BlobStoreTest, QuotaCountsRunningUploads) {
    const std::string big(kQuota / 2 + 1, 'b');
    const std::string other = Sha256Hex("other");
    auto upload = store.Begin(Sha256Hex(big), big.size(), 0);
    ExpectError(ErrorCode::kResourceExhausted, "does not fit",
                [&] { store.Begin(other, kQuota / 2, 0); });
    ExpectError(ErrorCode::kResourceExhausted, "does not fit",
                [&] { store.Begin(other, ~0ull, 0); });
    upload.reset();
    EXPECT_EQ(store.used(), 0u);
    EXPECT_NO_THROW(store.Begin(other, kQuota / 2, 0));
}

TEST_F(BlobStoreTest, OnlyDigestsBecomeFileNames) {
    for (const std::string& name :
         {std::string(), std::string("../../etc/passwd"), std::string(64, 'G'),
          std::string(64, 'A'), std::string(63, 'a'), std::string(62, 'a') + "/.",
          std::string(64, 'a') + "\n"}) {
        ExpectError(ErrorCode::kInvalidArgument, "no SHA-256", [&] { store.Has(name); });
        ExpectError(ErrorCode::kInvalidArgument, "no SHA-256", [&] { store.Begin(name, 1, 0); });
        ExpectError(ErrorCode::kInvalidArgument, "no SHA-256", [&] { store.Read(name, 0, 1); });
        ExpectError(ErrorCode::kInvalidArgument, "no SHA-256", [&] { store.PartSize(name); });
    }
    ExpectError(ErrorCode::kNotFound, "upload it first", [&] { store.SizeOf(Sha256Hex("none")); });
}

TEST_F(BlobStoreTest, AWriteThatFailsLeavesNothing) {
    // A limit on file sizes stands in for a full disk: both fail in write().
    const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
    rlimit old_limit{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old_limit), 0);
    rlimit limit = old_limit;
    limit.rlim_cur = 4096;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
    const std::string bytes(10'000, 'x');
    auto upload = store.Begin(Sha256Hex(bytes), bytes.size(), 0);
    ExpectError(ErrorCode::kFailedPrecondition, "can't write", [&] { upload->Append(bytes); });
    setrlimit(RLIMIT_FSIZE, &old_limit);
    std::signal(SIGXFSZ, old_handler);
    upload.reset();
    EXPECT_EQ(Files(), 0u);
    EXPECT_EQ(store.used(), 0u);
    Put(bytes);
}

TEST_F(BlobStoreTest, ManyThreadsAtOnce) {
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) {
        threads.emplace_back([&, t] {
            for (int i = 0; i < 50; ++i) {
                const std::string bytes = std::to_string(100 * t + i);
                EXPECT_EQ(store.Read(Put(bytes), 0, 100), bytes);
            }
        });
    }
    for (auto& thread : threads) {
        thread.join();
    }
    EXPECT_EQ(Files(), 200u);
}

}  // namespace
}  // namespace relume::store
