#include "client/lib/output_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/files.h"

namespace relume::client {
namespace {

namespace fs = std::filesystem;

// Names of what is in a folder.
std::vector<std::string> Names(const fs::path& folder) {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) {
        names.push_back(entry.path().filename());
    }
    std::sort(names.begin(), names.end());
    return names;
}

TEST(OutputFile, AppearsUnderItsNameAtCommit) {
    const TemporaryFolder folder;
    const fs::path path = folder.path() / "out.exr";
    OutputFile file(path);
    file.Append("one ");
    file.Append("two");
    EXPECT_EQ(file.size(), 7u);
    EXPECT_FALSE(fs::exists(path));
    EXPECT_EQ(ReadFile(file.temporary()), "one two");
    file.Commit();
    EXPECT_EQ(ReadFile(path), "one two");
    EXPECT_EQ(Names(folder.path()), std::vector<std::string>{"out.exr"});
}

TEST(OutputFile, LeavesNothingWithoutCommit) {
    const TemporaryFolder folder;
    {
        OutputFile file(folder.path() / "out.exr");
        file.Append("half of it");
    }
    EXPECT_TRUE(Names(folder.path()).empty());
}

TEST(OutputFile, KeepsTheOldFileUntilCommit) {
    const TemporaryFolder folder;
    const fs::path path = folder.path() / "out.exr";
    WriteFileAtomically(path, "old");
    OutputFile file(path);
    file.Append("new");
    EXPECT_EQ(ReadFile(path), "old");
    file.Commit();
    EXPECT_EQ(ReadFile(path), "new");
}

TEST(OutputFile, FollowsALink) {
    const TemporaryFolder folder;
    WriteFileAtomically(folder.path() / "real", "old");
    fs::create_symlink("real", folder.path() / "link");
    OutputFile file(folder.path() / "link");
    file.Append("new");
    file.Commit();
    EXPECT_TRUE(fs::is_symlink(folder.path() / "link"));
    EXPECT_EQ(ReadFile(folder.path() / "real"), "new");
}

TEST(OutputFile, WritesToADeviceAndLeavesItThere) {
    {
        OutputFile file("/dev/null");
        file.Append("gone");
        file.Commit();
    }
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(OutputFile, SaysThatADeviceIsFull) {
    OutputFile file("/dev/full");
    file.Append("no room");
    try {
        file.Commit();
        FAIL() << "/dev/full took it";
    } catch (const OutputError& error) {
        EXPECT_EQ(error.code(), ErrorCode::kResourceExhausted);
        EXPECT_NE(std::string(error.what()).find("/dev/full"), std::string::npos);
    }
}

// A file that may not grow stands for a disk that is full.
TEST(OutputFile, LeavesNothingWhenTheDiskIsFull) {
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit old;
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old), 0);
    rlimit tiny = old;
    tiny.rlim_cur = 4096;
    const TemporaryFolder folder;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &tiny), 0);
    std::string message;
    try {
        OutputFile file(folder.path() / "out.exr");
        file.Append(std::string(8192, 'x'));
    } catch (const OutputError& error) {
        message = error.what();
    }
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &old), 0);
    EXPECT_NE(message.find("out.exr"), std::string::npos) << message;
    EXPECT_NE(message.find("space"), std::string::npos) << message;
    EXPECT_TRUE(Names(folder.path()).empty());
}

TEST(CheckOutput, TakesAFreeAndATakenName) {
    const TemporaryFolder folder;
    EXPECT_NO_THROW(CheckOutput(folder.path() / "new"));
    EXPECT_TRUE(Names(folder.path()).empty());
    WriteFileAtomically(folder.path() / "old", "kept");
    EXPECT_NO_THROW(CheckOutput(folder.path() / "old"));
    EXPECT_EQ(ReadFile(folder.path() / "old"), "kept");
}

TEST(CheckOutput, RefusesFoldersAndPlacesThatAreNotThere) {
    const TemporaryFolder folder;
    EXPECT_THROW(CheckOutput(folder.path()), OutputError);
    EXPECT_THROW(CheckOutput(folder.path() / "no" / "such" / "file"), OutputError);
    EXPECT_THROW(CheckOutput(""), OutputError);
}

}  // namespace
}  // namespace relume::client
