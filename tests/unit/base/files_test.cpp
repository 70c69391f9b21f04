#include "core/base/files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <functional>

#include "core/base/error.h"

namespace relume {
namespace {

namespace fs = std::filesystem;

Error Fails(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& e) {
        return e;
    }
    ADD_FAILURE() << "nothing was thrown";
    return {ErrorCode::kInternal, ""};
}

std::vector<std::string> Names(const fs::path& folder) {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) {
        names.push_back(entry.path().filename());
    }
    return names;
}

TEST(Files, RoundTripKeepsEveryByte) {
    const TemporaryFolder folder;
    std::string bytes(100'000, '\0');
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        bytes[i] = static_cast<char>(i * 31);
    }
    WriteFileAtomically(folder.path() / "data", bytes);
    EXPECT_EQ(ReadFile(folder.path() / "data"), bytes);
    WriteFileAtomically(folder.path() / "data", "");
    EXPECT_EQ(ReadFile(folder.path() / "data"), "");
    EXPECT_THAT(Names(folder.path()), testing::ElementsAre("data"));
}

TEST(Files, AFileIsReplacedWhole) {
    const TemporaryFolder folder;
    const auto path = folder.path() / "data";
    WriteFileAtomically(path, "old and longer");
    const fs::path second_name = folder.path() / "second_name";
    fs::create_hard_link(path, second_name);
    WriteFileAtomically(path, "new");
    EXPECT_EQ(ReadFile(path), "new");
    // The old file was not written into: whoever had it open still reads the old bytes.
    EXPECT_EQ(ReadFile(second_name), "old and longer");
}

TEST(Files, WrittenFilesCanBeReadByOthers) {
    const TemporaryFolder folder;
    WriteFileAtomically(folder.path() / "data", "x");
    struct stat status {};
    ASSERT_EQ(stat((folder.path() / "data").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0644u);
}

TEST(Files, ALinkStaysAndItsTargetIsReplaced) {
    const TemporaryFolder folder;
    WriteFileAtomically(folder.path() / "target", "old");
    fs::create_symlink("target", folder.path() / "link");
    WriteFileAtomically(folder.path() / "link", "new");
    EXPECT_TRUE(fs::is_symlink(folder.path() / "link"));
    EXPECT_EQ(ReadFile(folder.path() / "target"), "new");
}

TEST(Files, ReadingWhatIsNotThereNamesIt) {
    const TemporaryFolder folder;
    const Error error = Fails([&] { ReadFile(folder.path() / "missing.gltf"); });
    EXPECT_EQ(error.code(), ErrorCode::kNotFound);
    EXPECT_THAT(error.what(), testing::HasSubstr("missing.gltf"));
    EXPECT_THAT(error.what(), testing::HasSubstr("No such file"));
}

TEST(Files, ReadingAFolderIsAnError) {
    const TemporaryFolder folder;
    const Error error = Fails([&] { ReadFile(folder.path()); });
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(error.what(), testing::HasSubstr("is a folder"));
}

TEST(Files, AFailedReadIsAnError) {
    // Address 0 of the own memory: the file opens, and reading it is an input/output error.
    const Error error = Fails([] { ReadFile("/proc/self/mem"); });
    EXPECT_EQ(error.code(), ErrorCode::kDataLoss);
    EXPECT_THAT(error.what(), testing::HasSubstr("/proc/self/mem"));
}

TEST(Files, WritingIntoAMissingFolderNamesThePath) {
    const TemporaryFolder folder;
    const Error error = Fails([&] { WriteFileAtomically(folder.path() / "no/data", "x"); });
    EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
    EXPECT_THAT(error.what(), testing::HasSubstr("no/data: can't write: No such file"));
}

TEST(Files, WritingOverAFolderLeavesNothingBehind) {
    const TemporaryFolder folder;
    fs::create_directory(folder.path() / "data");
    const Error error = Fails([&] { WriteFileAtomically(folder.path() / "data", "x"); });
    EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
    EXPECT_THAT(Names(folder.path()), testing::ElementsAre("data"));
}

TEST(Files, AFullDeviceIsSaidAndStaysADevice) {
    if (!fs::is_character_file("/dev/full")) {
        GTEST_SKIP() << "there is no /dev/full";
    }
    const Error error = Fails([] { WriteFileAtomically("/dev/full", "x"); });
    EXPECT_EQ(error.code(), ErrorCode::kResourceExhausted);
    EXPECT_THAT(error.what(), testing::HasSubstr("/dev/full: can't write: No space left"));
    EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST(Files, ANullDeviceTakesAllAndStaysADevice) {
    WriteFileAtomically("/dev/null", std::string(10'000, 'x'));
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(Files, AFileThatMayNotGrowIsAnErrorAndLeavesTheOldOne) {
    // As on a full disk, the write stops half-way.
    const TemporaryFolder folder;
    WriteFileAtomically(folder.path() / "data", "old");
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{4096, before.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
    const Error error =
        Fails([&] { WriteFileAtomically(folder.path() / "data", std::string(100'000, 'x')); });
    setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);
    EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
    EXPECT_THAT(error.what(), testing::HasSubstr("File too large"));
    EXPECT_EQ(ReadFile(folder.path() / "data"), "old");
    EXPECT_THAT(Names(folder.path()), testing::ElementsAre("data"));
}

TEST(TemporaryFolder, IsFreshAndGoesWithAllThatIsInIt) {
    fs::path path;
    {
        const TemporaryFolder folder, other;
        path = folder.path();
        EXPECT_NE(path, other.path());
        EXPECT_TRUE(fs::is_empty(path));
        fs::create_directories(path / "a/b");
        WriteFileAtomically(path / "a/b/data", "x");
        const TemporaryFolder inside(path);
        EXPECT_EQ(inside.path().parent_path(), path);
    }
    EXPECT_FALSE(fs::exists(path));
}

TEST(TemporaryFolder, AMissingParentIsNamed) {
    const TemporaryFolder folder;
    const Error error = Fails([&] { TemporaryFolder(folder.path() / "no"); });
    EXPECT_THAT(error.what(), testing::HasSubstr("/no: can't write"));
}

}  // namespace
}  // namespace relume
