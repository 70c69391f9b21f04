#include "server/store/data_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <fstream>

#include "core/base/error.h"
#include "core/base/files.h"

namespace relume::store {
namespace {

TEST(DataFolder, IsMadeWithItsParentsAndHeldByOne) {
    const TemporaryFolder root;
    const auto path = root.path() / "a" / "b";
    {
        const DataFolder first(path);
        EXPECT_TRUE(std::filesystem::is_directory(path));
        try {
            const DataFolder second(path);
            FAIL() << "two servers on one folder";
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
            EXPECT_THAT(error.what(), testing::HasSubstr("another server uses this folder"));
        }
    }
    EXPECT_NO_THROW(DataFolder{path});
}

TEST(DataFolder, APathThatIsAFileIsSaid) {
    const TemporaryFolder root;
    std::ofstream(root.path() / "file") << "x";
    try {
        const DataFolder folder(root.path() / "file");
        FAIL() << "a file was taken for a folder";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
        EXPECT_THAT(error.what(), testing::HasSubstr("file"));
    }
}

TEST(ThrowFileError, AFullDiskIsAnExhaustedResource) {
    for (const int error_number : {ENOSPC, EDQUOT}) {
        try {
            ThrowFileError("/data/x", "write", error_number);
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::kResourceExhausted);
            EXPECT_THAT(error.what(), testing::HasSubstr("free some space"));
        }
    }
}

}  // namespace
}  // namespace relume::store
