#include "core/scene/manifest.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/sha256.h"
#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using testing::HasSubstr;

std::string Digest(const std::string& text) {
    Sha256 sha;
    sha.Update(text);
    return sha.HexDigest();
}

SceneManifest TwoFiles() {
    return {"a.gltf", {{"a.gltf", 5, Digest("a")}, {"maps/b.png", 7, Digest("b")}}};
}

TEST(Manifest, GoodOnesPass) { EXPECT_NO_THROW(ValidateManifest(TwoFiles())); }

TEST(Manifest, EachFaultNamesItsEntry) {
    const auto message = [](auto change) {
        SceneManifest manifest = TwoFiles();
        change(&manifest);
        return MessageOf([&] { ValidateManifest(manifest); });
    };
    for (const char* path : {"/etc/passwd", "../b", "x/../../b", "", "a//b", "./b", "a\\b"}) {
        EXPECT_THAT(message([&](SceneManifest* m) { m->entries[1].path = path; }),
                    HasSubstr(fmt::format("'{}'", path)));
    }
    EXPECT_THAT(message([](SceneManifest* m) { m->entries[1].sha256 = "12"; }),
                HasSubstr("'maps/b.png': its SHA-256"));
    EXPECT_THAT(message([](SceneManifest* m) { m->entries.push_back(m->entries[1]); }),
                HasSubstr("'maps/b.png' is listed twice"));
    EXPECT_THAT(message([](SceneManifest* m) { m->main = "c.gltf"; }), HasSubstr("'c.gltf'"));
    EXPECT_THAT(message([](SceneManifest* m) { m->entries.resize(100'001); }),
                HasSubstr("100001 files"));
}

TEST(Manifest, PathsThatAreSafe) {
    for (const char* path : {"a", "a/b", "a/b c.png", "..a", "a..", "a/.hidden"}) {
        EXPECT_TRUE(IsSafeRelativePath(path)) << path;
    }
    EXPECT_FALSE(IsSafeRelativePath(std::string("a\0b", 3)));
    EXPECT_FALSE(IsSafeRelativePath(std::string(2000, 'a')));
}

// Else this one file would have the digest of two files, and a worker would take its scene for
// theirs, which it keeps.
TEST(Manifest, APathCantPretendToBeSeveralFiles) {
    const SceneManifest two = TwoFiles();
    SceneManifest one = two;
    one.entries = {{"a.gltf\n" + Digest("a") + "\nmaps/b.png", 7, Digest("b")}};
    one.main = "a.gltf";
    ASSERT_EQ(ManifestDigest(one), ManifestDigest(two));
    EXPECT_FALSE(IsSafeRelativePath(one.entries[0].path));
    EXPECT_THROW(ValidateManifest(one), Error);
    EXPECT_FALSE(IsSafeRelativePath("a\x7f"));
}

TEST(Manifest, DigestIsOfPathsAndContentsInAnyOrder) {
    const std::string digest = ManifestDigest(TwoFiles());
    // Its definition: so that a digest means the same in every version.
    EXPECT_EQ(digest,
              Digest("a.gltf\na.gltf\n" + Digest("a") + "\nmaps/b.png\n" + Digest("b") + "\n"));
    SceneManifest swapped = TwoFiles();
    std::reverse(swapped.entries.begin(), swapped.entries.end());
    EXPECT_EQ(ManifestDigest(swapped), digest);
}

TEST(Manifest, DigestDependsOnMainPathsAndContents) {
    const std::string digest = ManifestDigest(TwoFiles());
    SceneManifest other = TwoFiles();
    other.main = "maps/b.png";
    EXPECT_NE(ManifestDigest(other), digest);
    other = TwoFiles();
    other.entries[1].path = "maps/c.png";
    EXPECT_NE(ManifestDigest(other), digest);
    other = TwoFiles();
    other.entries[1].sha256 = Digest("c");
    EXPECT_NE(ManifestDigest(other), digest);
}

}  // namespace
}  // namespace relume::test
