#include "worker/loop/manifest_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/files.h"
#include "tests/unit/loop/fake_blobs.h"

namespace relume::worker {
namespace {

TEST(ManifestSource, FilesAreReadByPathAndFetchedOnce) {
    const TemporaryFolder folder;
    FakeBlobs blobs;
    BlobCache cache(folder.path(), 1 << 20);
    SceneManifest manifest{"main.gltf", {}};
    manifest.entries.push_back(blobs.AddFile("main.gltf", "{}"));
    for (int i = 0; i < 20; ++i) {
        manifest.entries.push_back(
            blobs.AddFile("textures/" + std::to_string(i), "texture " + std::to_string(i)));
    }
    const ManifestSource files(manifest, &cache, blobs.Fetch());
    files.FetchAll();
    EXPECT_EQ(blobs.asked().size(), 21u);
    EXPECT_EQ(files.Read("textures/13"), "texture 13");
    files.FetchAll();
    EXPECT_EQ(blobs.asked().size(), 21u);
    try {
        files.Read("textures/20");
        FAIL() << "a file was read that is not in the manifest";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kNotFound);
        EXPECT_THAT(error.what(), testing::HasSubstr("textures/20"));
    }
}

TEST(ManifestSource, WhatIsMissingAtTheServerIsThrown) {
    const TemporaryFolder folder;
    FakeBlobs blobs;
    BlobCache cache(folder.path(), 1 << 20);
    SceneManifest manifest{"a", {blobs.AddFile("a", "a"), {"b", 1, Sha256Hex("b")}}};
    const ManifestSource files(manifest, &cache, blobs.Fetch());
    EXPECT_THROW(files.FetchAll(), Error);
}

}  // namespace
}  // namespace relume::worker
