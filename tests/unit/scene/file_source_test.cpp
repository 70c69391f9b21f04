#include <filesystem>

#include "core/base/files.h"
#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

// folder/scene/{a.txt,maps/b.txt} and folder/secret.txt beside it.
class FolderSourceTest : public testing::Test {
  protected:
    FolderSourceTest() {
        fs::create_directories(scene_ / "maps");
        WriteFileAtomically(scene_ / "a.txt", "alpha");
        WriteFileAtomically(scene_ / "maps" / "b.txt", "beta");
        WriteFileAtomically(folder_.path() / "secret.txt", "secret");
        source_ = MakeFolderSource(scene_.string());
    }

    ErrorCode CodeOf(const std::string& name) const {
        try {
            source_->Read(name);
        } catch (const Error& error) {
            return error.code();
        }
        ADD_FAILURE() << name << " was read";
        return ErrorCode::kInternal;
    }

    TemporaryFolder folder_;
    fs::path scene_ = folder_.path() / "scene";
    std::unique_ptr<FileSource> source_;
};

TEST_F(FolderSourceTest, ReadsWhatIsBelow) {
    EXPECT_EQ(source_->Read("a.txt"), "alpha");
    EXPECT_EQ(source_->Read("maps/b.txt"), "beta");
}

TEST_F(FolderSourceTest, MissingFilesAreNotFoundAndNamed) {
    EXPECT_EQ(CodeOf("c.txt"), ErrorCode::kNotFound);
    EXPECT_THAT(MessageOf([&] { source_->Read("c.txt"); }),
                AllOf(HasSubstr("c.txt"), HasSubstr("restore")));
    EXPECT_EQ(CodeOf("maps"), ErrorCode::kInvalidArgument);
}

TEST_F(FolderSourceTest, NamesThatLeaveTheFolderAreRefused) {
    for (const std::string& name :
         {std::string("../secret.txt"), std::string("maps/../../secret.txt"),
          (folder_.path() / "secret.txt").string(), std::string(""), std::string("..")}) {
        EXPECT_EQ(CodeOf(name), ErrorCode::kInvalidArgument) << name;
    }
}

TEST_F(FolderSourceTest, LinksThatLeaveTheFolderAreRefused) {
    fs::create_symlink("../secret.txt", scene_ / "link.txt");
    fs::create_directory_symlink("..", scene_ / "up");
    EXPECT_EQ(CodeOf("link.txt"), ErrorCode::kInvalidArgument);
    EXPECT_EQ(CodeOf("up/secret.txt"), ErrorCode::kInvalidArgument);
    EXPECT_THAT(MessageOf([&] { source_->Read("link.txt"); }), HasSubstr("link.txt"));
}

TEST_F(FolderSourceTest, LinksWithinAndToTheFolderAreFine) {
    fs::create_symlink("maps/b.txt", scene_ / "within.txt");
    EXPECT_EQ(source_->Read("within.txt"), "beta");
    fs::create_directory_symlink(scene_, folder_.path() / "alias");
    EXPECT_EQ(MakeFolderSource((folder_.path() / "alias").string())->Read("a.txt"), "alpha");
}

TEST_F(FolderSourceTest, AFolderWhoseNameBeginsAlikeIsOutside) {
    fs::create_directory(folder_.path() / "scene2");
    WriteFileAtomically(folder_.path() / "scene2" / "c.txt", "gamma");
    fs::create_symlink("../scene2/c.txt", scene_ / "c.txt");
    EXPECT_EQ(CodeOf("c.txt"), ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace relume::test
